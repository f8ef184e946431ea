// @ts-check
/** Every real-world evaluation of an experiment, page by page, each with a link to its replay. */

import { get, queryString } from "../../lib/api.js";
import { h } from "../../lib/dom.js";
import { number } from "../../lib/format.js";
import { empty } from "../../lib/placeholders.js";
import { table } from "../../lib/table.js";

const PAGE_SIZE = 25;
const CHOICES = [["", "samples and probes"], ["sample", "samples, which are learned from"], ["probe", "probes, which are only looked at"]];
const KINDS = ["measured", "probed"];
const COLUMNS = ["Repetition", "Iteration", "Kind", "Fitness in reality", "Measured by", "When", "Replay"];

/**
 * Return the table, with its filters above and the way to its other pages below.
 *
 * @param {Page.ExperimentPage} page
 */
export function samples(page) {
  const place = h("div");
  const kind = h("select", {}, ...CHOICES.map(([value, label]) => h("option", { value }, label)));
  const repetition = h("input", { type: "number", min: 0, max: 1000000, step: 1, placeholder: "all", class: "short" });
  /** @type {(string | null)[]} */
  let cursors = [null];  // of this page and of those before it
  /** @type {string | null} */
  let next = null;
  let requests = 0;
  let isTurning = false;
  const load = async () => {
    const query = { limit: PAGE_SIZE, cursor: cursors.at(-1), kind: kind.value, repetition: repetition.value };
    const request = ++requests;
    const loaded = await get(`/experiments/${page.id}/samples`, query, page.signal);
    if (request !== requests) return;  // a later request has replaced this one
    next = loaded.next;
    const rows = (/** @type {Api.SampleRead[]} */ (loaded.items)).map((sample) => row(page, sample));
    place.replaceChildren(rows.length ? table("Real-world evaluations", COLUMNS, rows) : empty("Nothing was tried in reality yet."));
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
  const back = h("button", { type: "button", class: "quiet small", disabled: true, onclick: () => turnTo(cursors.slice(0, -1)) }, "Previous");
  const forward = h("button", { type: "button", class: "quiet small", disabled: true, onclick: () => turnTo([...cursors, next]) }, "Next");
  const status = h("span", { role: "status" });
  const filters = h("p", { class: "options", onchange: filter }, h("label", {}, "Show ", kind), h("label", {}, "Repetition ", repetition));
  page.sections.add(place, KINDS, load);
  return [filters, place, h("p", { class: "pages" }, back, status, forward)];
}

/**
 * @param {Page.ExperimentPage} page
 * @param {Api.SampleRead} sample
 */
function row({ id, isFunction }, { repetition, iteration, kind, ...sample }) {
  const query = { experiment: id, repetition, iteration };
  const address = isFunction ? `#/toy${queryString(query)}` : `#/replay${queryString({ ...query, kind: kind === "sample" ? "sample" : "transfer" })}`;
  const label = isFunction ? "Step" : "Replay";
  const link = h("a", { href: address, "aria-label": `${label}, repetition ${repetition}, iteration ${iteration}` }, label);
  return [repetition, iteration, kind, sample.fitness === null ? "physics failed" : number(sample.fitness),
    sample.measured_by, new Date(sample.measured_at).toLocaleString(), link];
}
