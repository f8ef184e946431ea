// @ts-check
/** Which pairs differ, and at which numbers of real-world evaluations. */

import { get } from "../../lib/api.js";
import { h } from "../../lib/dom.js";
import { failed, loading } from "../../lib/placeholders.js";
import { TESTS, wholeNumber } from "./address.js";
import { exports } from "./exports.js";
import { matrix } from "./matrix.js";
import { pairsTable } from "./pairs.js";
import { commonCount, isPooled, rangesOf, rangeText } from "./ranges.js";

const MOST = 20;  // experiments in one table: 190 pairs
const NOTE = "p is corrected by Holm’s method over all pairs. A pair differs where p is below 0.05; elsewhere it is not significantly " +
  "different (n. s.). d is Cohen’s effect size.";
const POOLED = "⚠ Pooled over a range, as in the paper: the values of one repetition at several numbers of evaluations are not independent, so p is " +
  "too small and too many pairs seem to differ. Trust a single number of evaluations.";

/**
 * Return the tests over a chosen range as a matrix, and over the paper's ranges pair by pair.
 *
 * @param {Page.CompareView} view
 * @returns {Page.ComparePart}
 */
export function significance(view) {
  const buttons = h("div", { class: "ranges", role: "group", "aria-label": "Range of real-world evaluations" });
  const changeRange = () => { view.change({ from: wholeNumber(from.value), to: wholeNumber(to.value) }); };
  const from = h("input", { type: "number", min: 0, max: 1000, step: 1, class: "short", onchange: changeRange });
  const to = h("input", { type: "number", min: 0, max: 1000, step: 1, class: "short", onchange: changeRange });
  const tests = Object.entries(TESTS).map(([value, { label }]) => h("option", { value }, label));
  const changeTest = () => { view.change({ test: /** @type {Page.Comparison["test"]} */ (test.value) }); };
  const test = h("select", { onchange: changeTest }, ...tests);
  const place = h("div");
  const pooled = h("p", { class: "caution", hidden: true }, POOLED);
  const element = h("section", { class: "card significance", "aria-labelledby": "differ" },
    h("div", { class: "titled" }, h("h2", { id: "differ" }, "Which differ"), h("p", { class: "options" }, h("label", {}, "Test ", test))),
    h("div", { class: "controls" }, buttons, h("label", {}, "from ", from), h("label", {}, "to ", to)), pooled, place, h("p", { class: "note" }, NOTE));
  let lastKey = "";
  let requests = 0;
  const update = (/** @type {unknown[]} */ events) => {
    const ids = view.cache.known(view.choice.experiments);
    element.hidden = ids.length < 2;
    if (element.hidden) return;
    const experiments = ids.flatMap((id) => view.cache.get(id) ?? []);
    const last = Math.max(1, ...experiments.map(lastEvaluation));
    const ranges = rangesOf(commonCount(experiments), last);
    const { from: chosenFrom, to: chosenTo } = view.choice;
    /** @type {Page.Range} */
    const range = chosenFrom === null && chosenTo === null ? ranges[0] : [chosenFrom ?? 1, chosenTo ?? last];
    test.value = view.choice.test;
    if (document.activeElement !== from) from.value = String(range[0]);
    if (document.activeElement !== to) to.value = String(range[1]);
    buttons.replaceChildren(...ranges.map((each) => rangeButton(each, range, view)));
    pooled.hidden = !isPooled(range);
    const key = JSON.stringify([ids, range, view.choice.test]);
    const isNew = key !== lastKey;
    if (!isNew && !events.length) return;
    lastKey = key;
    const request = ++requests;
    fill(place, view, { ids, range, ranges, isNew, isCurrent: () => request === requests && !view.signal.aborted });
  };
  return { element, update };
}

/** @param {Api.ExperimentRead} experiment */
const lastEvaluation = ({ level, spec }) => (level ? 0 : spec.iterations);

/**
 * @param {Page.Range} range
 * @param {Page.Range} chosen
 * @param {Page.CompareView} view
 */
function rangeButton(range, chosen, view) {
  const [from, to] = range;
  const isChosen = rangeText(range) === rangeText(chosen);
  const press = () => view.change({ from, to });
  return h("button", { type: "button", class: "quiet small", "aria-pressed": String(isChosen), onclick: press },
    isPooled(range) ? `${rangeText(range)}, pooled as in the paper` : `at ${from}`);
}

/**
 * @typedef {object} Request
 * @property {string[]} ids
 * @property {Page.Range} range
 * @property {Page.Range[]} ranges that are offered
 * @property {boolean} isNew whether it asks for something else than the request before
 * @property {() => boolean} isCurrent whether no later request has replaced it
 */

/**
 * Load the tests and show them; if that fails, what is shown for the same request stays.
 *
 * @param {HTMLElement} place
 * @param {Page.CompareView} view
 * @param {Request} request
 */
async function fill(place, view, request) {
  const { ids, range, ranges: offered, isNew, isCurrent } = request;
  if (ids.length > MOST) {
    place.replaceChildren(h("p", {}, `Pairs are tested for up to ${MOST} experiments; these are ${ids.length}.`));
    return;
  }
  if (isNew && !place.hasChildNodes()) place.replaceChildren(loading());
  const ranges = [...offered.filter((each) => rangeText(each) !== rangeText(range)), range];
  try {
    const answers = await Promise.all(ranges.map(([from, to]) => get("/comparisons", { experiment: ids, from, to }, view.signal)));
    if (!isCurrent()) return;
    const results = ranges.map((each, index) => ({ range: each, pairs: answers[index] }));
    const isOpen = place.querySelector("details")?.open ?? false;
    place.replaceChildren(...matrix(view, ids, results[results.length - 1]), exports(ids, range), pairsTable(view, results, isOpen));
  } catch (error) {
    const stays = !isNew && place.querySelector("table");
    if (isCurrent() && !stays) place.replaceChildren(failed(error, () => fill(place, view, request), "h3"));
  }
}
