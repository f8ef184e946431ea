// @ts-check
/** Which pairs differ, and at which numbers of real-world evaluations: what the service says. */

import { get } from "../../lib/api.js";
import { h, refill, refillInPlace } from "../../lib/dom.js";
import { failed } from "../../lib/placeholders.js";
import { CURVE_KINDS } from "../../lib/event_kinds.js";
import { AXES, costQuery, positive, TESTS, wholeNumber } from "./address.js";
import { files, foldedPairs, matrix, pairsTable, pooledTable, rangeText, summaries, UNPAIRED } from "./pair_tables.js";

const MOST = 20;  // experiments in one table: 190 pairs
const PERCENT = 100;
const NOTE = "p is corrected by Holm’s method over all pairs; raw p is not. A pair differs where p is below 0.05; elsewhere it is not shown to " +
  "differ (n. s.), which does not show that it is equal: for that, give a margin. d is Cohen’s effect size. Experiments of one seed and one " +
  "strategy draw the same random numbers; such a pair is tested by repetition (paired).";

/**
 * Return the tests over a chosen range as a matrix, and over other ranges pair by pair.
 *
 * @param {Page.CompareView} view
 * @returns {Page.Updatable}
 */
export function significance(view) {
  const buttons = h("div", { class: "ranges", role: "group", "aria-label": "Range of real-world evaluations" });
  const changeRange = () => view.change({ from: wholeNumber(from.value), to: wholeNumber(to.value) });
  const from = h("input", { type: "number", min: 0, max: 1000, step: 1, class: "short", onchange: changeRange });
  const to = h("input", { type: "number", min: 0, max: 1000, step: 1, class: "short", onchange: changeRange });
  const tests = Object.entries(TESTS).map(([value, { label }]) => h("option", { value }, label));
  const test = h("select", { onchange: () => view.change({ test: /** @type {Page.Comparison["test"]} */ (test.value) }) }, ...tests);
  const equal = h("input", { type: "checkbox", onchange: () => view.change({ equal: equal.checked }) });
  const equalText = h("span");
  const equalLabel = h("label", {}, equal, equalText);
  const range = h("span", { class: "range" }, buttons, h("label", {}, "from ", from), h("label", {}, "to ", to));
  const place = h("div");
  const margin = marginField(view);
  const element = h("section", { class: "card significance", "aria-labelledby": "differ" },
    h("div", { class: "titled" }, h("h2", { id: "differ" }, "Which differ"), h("p", { class: "options" }, h("label", {}, "Test ", test))),
    h("div", { class: "controls" }, equalLabel, range, margin.element), place, h("p", { class: "note" }, NOTE));
  let [lastKey, shownKey, requests] = ["", "", 0];
  /** @type {number | null} */
  let shared = null;
  const showRange = (/** @type {number | null} */ first, /** @type {number | null} */ last) => {
    if (document.activeElement !== from) from.value = String(first ?? "");
    if (document.activeElement !== to) to.value = String(last ?? "");
    refillInPlace(buttons, JSON.stringify([shared, first, last]), () => (shared === null ? rangeButton(null, null, false, view)
      : rangesOf(shared).map(([one, other]) => rangeButton(one, other, one === first && other === last, view))));
  };
  const load = async () => {
    const request = ++requests;
    const key = keyOf(view);
    const isCurrent = () => request === requests && !view.signal.aborted;
    try {
      const pairs = await fill(place, view, isCurrent, () => loadNow());
      if (!isCurrent()) return undefined;
      shownKey = key;
      if (!pairs) return undefined;
      shared = pairs[0].shared_evaluations;
      if (!isAtCost(view)) showRange(pairs[0].from_evaluations, pairs[0].to_evaluations);
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
    element.hidden = view.cache.known(view.choice.experiments).length < 2;
    if (element.hidden) return;
    equalLabel.hidden = view.choice.x === "evaluations";
    equal.checked = view.choice.equal;
    equalText.textContent = ` at equal ${AXES[view.choice.x].toLowerCase()}: the least that all have spent`;
    range.hidden = isAtCost(view);
    const last = view.choice.to ?? shared;
    showRange(view.choice.from ?? last, last);
    test.value = view.choice.test;
    margin.update();
    const key = keyOf(view);
    if (key === lastKey) return;
    lastKey = key;
    loadNow();
  };
  return { element, update };
}

/** Return whether pairs are tested at equal rollouts, time or cost. @param {Page.CompareView} view */
const isAtCost = ({ choice: { x, equal } }) => equal && x !== "evaluations";

/** Return what is equal in the pairs, as a query has it. @param {Page.CompareView} view */
const placeOf = (view) => (isAtCost(view) ? costQuery(view.choice) : { from: view.choice.from, to: view.choice.to });

/**
 * Return a key of what the reader chose.
 *
 * @param {Page.CompareView} view
 */
function keyOf(view) {
  const { cache, choice: { experiments, test, fitness, margin, margin_of_direct: share } } = view;
  return JSON.stringify([cache.known(experiments), placeOf(view), test, fitness, margin, share]);
}

/**
 * Return the ranges that are offered, the last shared number first: single numbers, and the paper's ranges up to the last shared number.
 *
 * @param {number} shared
 * @returns {Page.Range[]}
 */
export function rangesOf(shared) {
  /** @type {Page.Range[]} */
  const ranges = [[shared, shared], [1, 1], [3, shared], [6, shared], [1, shared]];
  const unique = new Map(ranges.map((range) => [rangeText(range), range]));
  return [...unique.values()].filter(([from, to]) => from <= to && to <= shared);
}

/** @type {(from: number | null, to: number | null, isChosen: boolean, view: Page.CompareView) => HTMLElement} */
function rangeButton(from, to, isChosen, view) {
  const text = from === null || to === null ? "at the last shared number" : from === to ? `at ${from}` : `mean of ${rangeText([from, to])}`;
  return h("button", { type: "button", class: "quiet small", "aria-pressed": String(isChosen), onclick: () => view.change({ from, to }) }, text);
}

/**
 * Return the field for the margin within which two experiments count as equivalent, in the unit of fitness or as a share of direct.
 *
 * @param {Page.CompareView} view
 * @returns {Page.Updatable}
 */
function marginField(view) {
  const change = () => {
    const width = positive(number.value);
    const isShare = unit.value === "share";
    view.change({ margin: isShare ? null : width, margin_of_direct: isShare && width ? width / PERCENT : null });
  };
  const number = h("input", { type: "number", min: 0, step: "any", class: "short", placeholder: "none", onchange: change });
  const unit = h("select", { "aria-label": "Unit of the margin", onchange: change },
    h("option", { value: "fitness" }, "in the unit of fitness"), h("option", { value: "share" }, "% of direct"));
  const update = () => {
    const { margin, margin_of_direct: share } = view.choice;
    if (margin !== null || share !== null) unit.value = share === null ? "fitness" : "share";
    if (document.activeElement !== number) number.value = String(share === null ? margin ?? "" : Number((share * PERCENT).toPrecision(12)));
  };
  return { element: h("span", { class: "margin" }, h("label", {}, "equivalent within ± ", number), " ", unit), update };
}

/**
 * Load the tests and show them; return those of the chosen range. Other ranges are loaded only while the table that shows them is unfolded.
 *
 * @param {HTMLElement} place
 * @param {Page.CompareView} view
 * @param {() => boolean} isCurrent whether no later request has replaced it
 * @param {() => void} unfolded called when the table of every range is unfolded
 * @returns {Promise<Api.Comparison[] | null>}
 */
async function fill(place, view, isCurrent, unfolded) {
  const { experiments, margin, margin_of_direct: share, test, fitness } = view.choice;
  const ids = view.cache.known(experiments);
  if (ids.length < 2) return null;
  if (ids.length > MOST) {
    refill(place, String(ids.length), () => h("p", {}, `Pairs are tested for up to ${MOST} experiments; these are ${ids.length}.`));
    return null;
  }
  const load = (/** @type {Page.Query} */ query) => get("/comparisons", { study: ids, fitness, ...query }, view.signal);
  /** @type {Api.Comparison[]} */
  const pairs = await load({ ...placeOf(view), margin, margin_of_direct: share });
  const { from_evaluations: first, to_evaluations: last, shared_evaluations: shared } = pairs[0];
  const isOpen = (/** @type {string} */ name) => place.querySelector(`details.${name}`)?.hasAttribute("open") ?? false;
  const hasOthers = isOpen("every");
  const others = hasOthers && !isAtCost(view) ? rangesOf(shared).filter(([one, other]) => one !== first || other !== last) : [];
  const results = await Promise.all(others.map(async (range) => ({ range, pairs: await load({ from: range[0], to: range[1], intervals: false }) })));
  if (!isCurrent()) return null;
  results.push({ range: [first, last], pairs });
  const asked = { study: ids, ...(isAtCost(view) ? placeOf(view) : { from: first, to: last }), margin, margin_of_direct: share, fitness };
  refillInPlace(place, JSON.stringify([results, hasOthers, test, [...view.cache.namesOf(experiments)]]), () => [
    cautions(view, pairs), matrix(view, ids, pairs, isOpen("alike")), files(asked), summaries(view, pairs, isOpen("each")),
    hasOthers ? pairsTable(view, results, isOpen("every")) : foldedPairs(unfolded), pooledTable(view, pairs, isOpen("pooled"))]);
  return pairs;
}

/**
 * Return why the chosen unpaired test is not to be trusted, if a pair shares random streams.
 *
 * @param {Page.CompareView} view
 * @param {Api.Comparison[]} pairs
 */
function cautions({ choice }, pairs) {
  if (!UNPAIRED.some((name) => name === choice.test)) return [];
  const found = new Set(pairs.flatMap(({ caution }) => caution ?? []));
  return [...found].map((caution) => h("p", { class: "caution" }, `⚠ ${caution}.`));
}
