/** What happened, the newest first, as it happens. */

import { get } from "../../lib/api.js";
import { h } from "../../lib/dom.js";
import { age } from "../../lib/format.js";
import { KINDS, words } from "./words.js";

const AT_ONCE = 60;  // events that are shown at first, and more on demand
const SHOWN = 600;  // at most: a page that is open for days stays light
const PAGE = 1000;  // of the service, at most
const WINDOW = 400;  // numbers that are looked through at once, those of all experiments together
const RETIMED_MS = 30_000;

/** The list, which takes in what happens to the experiment. */
export function feed(page) {
  const list = h("ol", { class: "events" });
  const more = h("button", { type: "button", class: "quiet small" }, "Earlier");
  const body = h("div", { class: "feed framed", tabindex: "0", role: "region", "aria-label": "Latest events" });
  const about = (query) => get("/events/page", { experiment: page.id, limit: PAGE, ...query }, page.signal);
  const past = history(about, page.latest);
  let newest = page.latest;
  let going = null;

  const lengthen = async () => {
    list.append(...(await past.some(AT_ONCE)).map(entry));
    more.hidden = past.over();
  };
  const earlier = () => {  // pressed twice, once
    going ??= lengthen().finally(() => { going = null; });
    return going;
  };
  const later = async () => {
    for (let full = true; full;) {
      const { items, last } = await about({ after: newest });
      list.prepend(...items.toReversed().map(entry));
      newest = last;
      full = items.length === PAGE;
    }
    while (list.childElementCount > SHOWN) list.lastElementChild.remove();
    if (list.childElementCount === SHOWN) more.hidden = true;
  };
  more.addEventListener("click", () => earlier().catch(() => {}));
  page.parts.add(body, KINDS, async () => {
    if (!body.contains(list)) {
      await earlier();
      body.replaceChildren(list, more);
    }
    await later();
  });
  const timer = setInterval(() => retime(list), RETIMED_MS);
  page.signal.addEventListener("abort", () => clearInterval(timer));
  return h("section", { class: "card happening", "aria-labelledby": "events-title" }, h("h2", { id: "events-title" }, "What happens"), body);
}

/** The events up to the number `latest`, the newest first, some at a time: the service has them in their order alone. */
function history(about, latest) {
  let left = latest;
  return {
    over: () => left === 0,
    some: async (many) => {
      let found = [];
      for (let size = WINDOW; left > 0 && found.length < many;) {
        const after = Math.max(0, left - size);
        const { items, last } = await about({ after });
        if (last < left) {  // the window has more than a page; one of a page's size has not
          size = PAGE;
          continue;
        }
        found = [...items.filter((each) => each.number <= left), ...found];
        left = after;
        size *= 4;
      }
      return found.reverse();
    },
  };
}

function entry(event) {
  const time = h("time", { datetime: event.at, title: new Date(event.at).toLocaleString() }, age(event.at));
  return h("li", { class: event.kind, dataset: { number: event.number } }, h("span", {}, words(event)), " ", time);
}

function retime(list) {
  for (const time of list.querySelectorAll("time")) time.textContent = age(time.dateTime);
}
