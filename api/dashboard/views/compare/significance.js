// @ts-check
/** Which pairs differ, and at which numbers of real-world evaluations. */

import { get } from "../../lib/api.js";
import { h } from "../../lib/dom.js";
import { failed, loading } from "../../lib/placeholders.js";
import { TESTS, wholeNumber } from "./address.js";
import { exports } from "./exports.js";
import { marginField } from "./margin.js";
import { matrix } from "./matrix.js";
import { pairsTable, pooledTable } from "./pairs.js";
import { commonCount, isSeveral, rangesOf, rangeText } from "./ranges.js";
import { summaries } from "./summaries.js";

const MOST = 20;  // experiments in one table: 190 pairs
const NOTE = "p is corrected by Holm’s method over all pairs; raw p is not. A pair differs where p is below 0.05; elsewhere it is not shown to " +
  "differ (n. s.), which does not show that it is equal: for that, give a margin. d is Cohen’s effect size. Experiments of one seed and one " +
  "strategy draw the same random numbers; such a pair is tested by repetition (paired).";
const UNPAIRED = ["student", "welch", "mann_whitney"];

/**
 * Return the tests over a chosen range as a matrix, and over other ranges pair by pair.
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
  const margin = marginField(view);
  const element = h("section", { class: "card significance", "aria-labelledby": "differ" },
    h("div", { class: "titled" }, h("h2", { id: "differ" }, "Which differ"), h("p", { class: "options" }, h("label", {}, "Test ", test))),
    h("div", { class: "controls" }, buttons, h("label", {}, "from ", from), h("label", {}, "to ", to), margin.element), place, h("p", { class: "note" }, NOTE));
  let lastKey = "";
  let requests = 0;
  const update = (/** @type {unknown[]} */ events) => {
    const ids = view.cache.known(view.choice.experiments);
    element.hidden = ids.length < 2;
    if (element.hidden) return;
    const experiments = ids.flatMap((id) => view.cache.get(id) ?? []);
    const shared = commonCount(experiments);
    const ranges = rangesOf(shared);
    const last = view.choice.to ?? shared;
    /** @type {Page.Range} */
    const range = [view.choice.from ?? last, last];
    test.value = view.choice.test;
    if (document.activeElement !== from) from.value = String(range[0]);
    if (document.activeElement !== to) to.value = String(range[1]);
    buttons.replaceChildren(...ranges.map((each) => rangeButton(each, range, view)));
    margin.update([]);
    const { test: byTest, margin: width, margin_of_direct: share } = view.choice;
    const key = JSON.stringify([ids, range, byTest, width, share]);
    const isNew = key !== lastKey;
    if (!isNew && !events.length) return;
    lastKey = key;
    const request = ++requests;
    fill(place, view, { ids, range, ranges, isNew, isCurrent: () => request === requests && !view.signal.aborted });
  };
  return { element, update };
}

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
    isSeveral(range) ? `mean of ${rangeText(range)}` : `at ${from}`);
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
  const { margin, margin_of_direct: share } = view.choice;
  const others = offered.filter((each) => rangeText(each) !== rangeText(range));
  const asked = { experiment: ids, from: range[0], to: range[1], margin, margin_of_direct: share };
  const queries = [...others.map(([from, to]) => ({ experiment: ids, from, to, intervals: false })), asked];
  try {
    const answers = await Promise.all(queries.map((query) => get("/comparisons", query, view.signal)));
    if (!isCurrent()) return;
    const results = [...others, range].map((each, index) => ({ range: each, pairs: answers[index] }));
    const pairs = answers[answers.length - 1];
    const isOpen = (/** @type {string} */ name) => place.querySelector(`details.${name}`)?.hasAttribute("open") ?? false;
    place.replaceChildren(...cautions(view, pairs), ...matrix(view, ids, results[results.length - 1]), exports(asked), summaries(view, pairs, isOpen("each")),
      pairsTable(view, results, isOpen("every")), ...[pooledTable(view, pairs, isOpen("pooled"))].flatMap((found) => found ?? []));
  } catch (error) {
    const stays = !isNew && place.querySelector("table");
    if (isCurrent() && !stays) place.replaceChildren(failed(error, () => fill(place, view, request), "h3"));
  }
}

/**
 * Return why the chosen unpaired test is not to be trusted, if a pair shares random streams.
 *
 * @param {Page.CompareView} view
 * @param {Api.Comparison[]} pairs
 */
function cautions({ choice }, pairs) {
  if (!UNPAIRED.includes(choice.test)) return [];
  const found = new Set(pairs.flatMap(({ caution }) => caution ?? []));
  return [...found].map((caution) => h("p", { class: "caution" }, `⚠ ${caution}.`));
}
