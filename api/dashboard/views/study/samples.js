// @ts-check
/** Every real-world evaluation of an experiment, each with a link to its replay, in a list that is shown page by page. */

import { get, queryString } from "../../lib/api.js";
import { button, h, refillInPlace, select } from "../../lib/dom.js";
import { number } from "../../lib/format.js";
import { empty } from "../../lib/placeholders.js";
import { table } from "../../lib/table.js";

const PAGE_SIZE = 25;
/** @type {Page.Choices} */
const CHOICES = [["", "samples and probes"], ["sample", "samples, which are learned from"], ["probe", "probes, which are only looked at"]];
const KINDS = ["measured", "probed"];
const COLUMNS = ["Repetition", "Iteration", "Kind", "Fitness in reality", "Measured by", "When", "Replay"];

/** Return the table, with its filters above and the way to its other pages below. @param {Page.StudyPage} page */
export function samples(page) {
  const kind = select(CHOICES);
  const repetition = h("input", { type: "number", min: 0, max: 1000000, step: 1, placeholder: "all", class: "short" });
  const render = (/** @type {Api.SampleRead[]} */ items) =>
    [items.length ? table("Real-world evaluations", COLUMNS, items.map((sample) => row(page, sample))) : empty("Nothing was tried in reality yet.")];
  return pagedList(page, {
    path: `/experiments/${page.experiment.id}/samples`, size: PAGE_SIZE, kinds: KINDS, render,
    filters: h("p", { class: "options" }, h("label", {}, "Show ", kind), h("label", {}, "Repetition ", repetition)),
    query: () => ({ kind: kind.value, repetition: repetition.value }),
  });
}

/**
 * Return a link to the replay of a controller; a function is stepped through instead.
 * @param {Page.StudyPage} page
 * @param {{ repetition: number, iteration: number, kind: Api.MeasurementKind }} measured
 */
export function replayLink({ experiment: { id }, isFunction }, { repetition, iteration, kind }) {
  const query = { experiment: id, repetition, iteration };
  const address = isFunction ? `#/toy${queryString(query)}` : `#/replay${queryString({ ...query, kind: kind === "sample" ? "sample" : "transfer" })}`;
  const label = isFunction ? "Step" : "Replay";
  return h("a", { href: address, "aria-label": `${label}, repetition ${repetition}, iteration ${iteration}` }, label);
}

/** @param {Page.StudyPage} page @param {Api.SampleRead} sample */
function row(page, sample) {
  const { repetition, iteration, kind, fitness } = sample;
  return [repetition, iteration, kind, fitness === null ? "physics failed" : number(fitness),
    sample.measured_by, new Date(sample.measured_at).toLocaleString(), replayLink(page, sample)];
}

/**
 * Return the filters, the place of the list, and the buttons that turn its pages.
 * @param {Page.StudyPage} page
 * @param {object} list
 * @param {string} list.path
 * @param {HTMLElement} list.filters a change in it shows the first page
 * @param {() => Page.Query} list.query what the filters ask for
 * @param {number} list.size of a page
 * @param {string[]} list.kinds of events that change it
 * @param {(items: any[], isFirst: boolean) => Page.Child[]} list.render
 */
export function pagedList(page, { path, filters, query, size, kinds, render }) {
  const place = h("div");
  /** @type {(string | null)[]} */
  let cursors = [null];  // of this page and of those before it
  /** @type {string | null} */
  let next = null;
  let requests = 0;
  let isTurning = false;
  const load = async () => {
    const request = ++requests;
    const loaded = await get(path, { limit: size, cursor: cursors.at(-1), ...query() }, page.signal);
    if (request !== requests) return;  // a later request has replaced this one
    next = loaded.next;
    refillInPlace(place, JSON.stringify([loaded.items, query()]), () => render(loaded.items, cursors.length === 1));
    back.disabled = cursors.length < 2;
    forward.disabled = !next;
    status.textContent = `Page ${cursors.length}`;
  };
  const showError = (/** @type {Error} */ error) => { status.textContent = error.message; };
  const turnTo = async (/** @type {(string | null)[]} */ newCursors) => {
    if (isTurning) return;
    const before = cursors;
    isTurning = true;
    cursors = newCursors;
    try {
      await load();
    } catch (error) {
      if (cursors === newCursors) cursors = before;
      showError(error);
    }
    isTurning = false;
  };
  const filter = () => {
    cursors = [null];
    load().catch(showError);
  };
  const back = button("Previous", () => turnTo(cursors.slice(0, -1)), { disabled: true });
  const forward = button("Next", () => turnTo([...cursors, next]), { disabled: true });
  const status = h("span", { role: "status" });
  filters.addEventListener("change", filter);
  page.sections.add(place, kinds, load);
  return [filters, place, h("p", { class: "pages" }, back, status, forward)];
}
