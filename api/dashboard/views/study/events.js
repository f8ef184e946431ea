// @ts-check
/** The events of an experiment, the newest first, as they happen. */

import { get } from "../../lib/api.js";
import { button, h } from "../../lib/dom.js";
import { ageOf } from "../../lib/live.js";

const BATCH = 60;  // events that are shown at first, and more on demand
const MOST = 600;  // a page that is open for days stays light
const PAGE_SIZE = 1000;  // the service's limit
const WINDOW = 400;  // event numbers that are searched at once; they count the events of all experiments

/** @typedef {(query: Page.Query) => Promise<Api.EventPage>} Load */

/** Return the list, which grows with the experiment. @param {Page.StudyPage} page */
export function eventList(page) {
  const list = h("ol", { class: "events" });
  const more = button("Earlier", () => showEarlier().catch(() => {}));
  const body = h("div", { class: "event-list framed", tabindex: "0", role: "region", "aria-label": "Latest events" });
  /** @type {Load} */
  const load = (query) => get("/events/page", { study: page.id, limit: PAGE_SIZE, ...query }, page.signal);
  const past = pastEvents(load, page.latest);
  let newest = page.latest;
  /** @type {Promise<void> | null} */
  let loading = null;

  const append = async () => {
    list.append(...(await past.next(BATCH)).map(entry));
    more.hidden = past.isOver();
  };
  const showEarlier = () => {
    loading ??= append().finally(() => { loading = null; });
    return loading;
  };
  const showLater = async () => {
    for (let isFull = true; isFull;) {
      const { items, last } = await load({ after: newest });
      list.prepend(...items.toReversed().map(entry));
      newest = last;
      isFull = items.length === PAGE_SIZE;
    }
    while (list.childElementCount > MOST) list.lastElementChild?.remove();
    if (list.childElementCount === MOST) more.hidden = true;
  };
  page.sections.add(body, null, async () => {
    if (!body.contains(list)) {
      await showEarlier();
      body.replaceChildren(list, more);
    }
    await showLater();
  });
  return h("section", { class: "card happening", "aria-labelledby": "events-title" }, h("h2", { id: "events-title" }, "Events"), body);
}

/**
 * Return the events up to a number, the newest first, some at a time. The service lists events in their order only.
 * @param {Load} load
 * @param {number} latest
 */
export function pastEvents(load, latest) {
  let left = latest;
  return {
    isOver: () => left === 0,
    /** @param {number} wanted */
    next: async (wanted) => {
      /** @type {Api.EventRead[]} */
      let events = [];
      for (let size = WINDOW; left > 0 && events.length < wanted;) {
        const after = Math.max(0, left - size);
        const { items, last } = await load({ after });
        if (last < left) {  // the window holds more than a page; one of the size of a page cannot
          size = PAGE_SIZE;
          continue;
        }
        events = [...items.filter(({ number }) => number <= left), ...events];
        left = after;
        size *= 4;
      }
      return events.reverse();
    },
  };
}

/** @param {Api.EventRead} event */
function entry(event) {
  return h("li", { class: event.kind, dataset: { number: event.number } }, h("span", {}, event.sentence), " ", ageOf(event.at));
}
