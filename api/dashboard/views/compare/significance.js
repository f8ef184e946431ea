// @ts-check
/** Which pairs differ, and at which numbers of real-world evaluations. */

import { get } from "../../lib/api.js";
import { h, refill, refillInPlace } from "../../lib/dom.js";
import { failed } from "../../lib/placeholders.js";
import { CURVE_KINDS } from "../../lib/event_kinds.js";
import { TESTS, wholeNumber } from "./address.js";
import { exports } from "./exports.js";
import { marginField } from "./margin.js";
import { matrix } from "./matrix.js";
import { foldedPairs, pairsTable, pooledTable } from "./pairs.js";
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
  let shownKey = "";
  let requests = 0;
  const load = async () => {
    const request = ++requests;
    const key = keyOf(view);
    const isCurrent = () => request === requests && !view.signal.aborted;
    try {
      await fill(place, view, isCurrent, () => loadNow());
      if (isCurrent()) shownKey = key;
    } catch (error) {
      if (!isCurrent()) return undefined;
      if (shownKey === key) return "failed";
      shownKey = "";
      refill(place, `failed ${request}`, () => failed(error, loadNow, "h3"));
    }
    return undefined;
  };
  const loadNow = view.sections.add(place, CURVE_KINDS, load);
  const update = () => {
    const { ids, range, ranges } = askedRanges(view);
    element.hidden = ids.length < 2;
    if (element.hidden) return;
    test.value = view.choice.test;
    if (document.activeElement !== from) from.value = String(range[0]);
    if (document.activeElement !== to) to.value = String(range[1]);
    refillInPlace(buttons, JSON.stringify([ranges, range]), () => ranges.map((each) => rangeButton(each, range, view)));
    margin.update();
    const key = keyOf(view);
    if (key === lastKey) return;
    lastKey = key;
    loadNow();
  };
  return { element, update };
}

/**
 * Return a key of what the reader chose; the ranges that are offered grow without a choice.
 *
 * @param {Page.CompareView} view
 */
function keyOf({ cache, choice: { experiments, from, to, test, fitness, margin, margin_of_direct: share } }) {
  return JSON.stringify([cache.known(experiments), from, to, test, fitness, margin, share]);
}

/**
 * Return the chosen experiments that exist, the range that is asked for, and the ranges that are offered.
 *
 * @param {Page.CompareView} view
 * @returns {{ ids: string[], range: Page.Range, ranges: Page.Range[] }}
 */
function askedRanges({ cache, choice }) {
  const ids = cache.known(choice.experiments);
  const shared = commonCount(ids.flatMap((id) => cache.get(id) ?? []));
  const last = choice.to ?? shared;
  return { ids, range: [choice.from ?? last, last], ranges: rangesOf(shared) };
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
 * Load the tests and show them. The other ranges are loaded only while the table that shows them is unfolded.
 *
 * @param {HTMLElement} place
 * @param {Page.CompareView} view
 * @param {() => boolean} isCurrent whether no later request has replaced it
 * @param {() => void} unfolded called when the table of every range is unfolded
 */
async function fill(place, view, isCurrent, unfolded) {
  const { ids, range, ranges } = askedRanges(view);
  if (ids.length < 2) return;
  if (ids.length > MOST) {
    refill(place, String(ids.length), () => h("p", {}, `Pairs are tested for up to ${MOST} experiments; these are ${ids.length}.`));
    return;
  }
  const { margin, margin_of_direct: share, test, fitness } = view.choice;
  const isOpen = (/** @type {string} */ name) => place.querySelector(`details.${name}`)?.hasAttribute("open") ?? false;
  const hasOthers = isOpen("every");
  const others = hasOthers ? ranges.filter((each) => rangeText(each) !== rangeText(range)) : [];
  const asked = { study: ids, from: range[0], to: range[1], margin, margin_of_direct: share, fitness };
  const queries = [...others.map(([from, to]) => ({ study: ids, from, to, fitness, intervals: false })), asked];
  const answers = await Promise.all(queries.map((query) => get("/comparisons", query, view.signal)));
  if (!isCurrent()) return;
  const results = [...others, range].map((each, index) => ({ range: each, pairs: answers[index] }));
  const pairs = answers[answers.length - 1];
  const names = [...view.cache.namesOf(view.choice.experiments)];
  refillInPlace(place, JSON.stringify([answers, range, others, hasOthers, test, names]), () => [
    cautions(view, pairs), matrix(view, ids, results[results.length - 1]), exports(asked), summaries(view, pairs, isOpen("each")),
    hasOthers ? pairsTable(view, results, isOpen("every")) : foldedPairs(unfolded), pooledTable(view, pairs, isOpen("pooled"))]);
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
