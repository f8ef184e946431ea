// @ts-check
/** Every pair with every test, and where along the curve it differs. */

import { h } from "../../lib/dom.js";
import { loading } from "../../lib/placeholders.js";
import { table } from "../../lib/table.js";
import { TESTS } from "./address.js";
import { isSeveral, letter, rangeText } from "./ranges.js";
import { bothProbabilities, estimated, interval, probability, signed, verdict } from "./verdict.js";

const EVERY = "Every pair, at every range, by every test";
const UNPAIRED = /** @type {const} */ (["student", "welch", "mann_whitney"]);
const PAIRED = /** @type {const} */ (["paired_t", "wilcoxon"]);

/**
 * Return a table of the pairs: each range by the chosen test, and the numbers of the last range by all tests.
 *
 * @param {Page.CompareView} view
 * @param {Page.RangeResult[]} results
 * @param {boolean} open whether the table is unfolded
 */
export function pairsTable({ choice: { test, experiments }, cache }, results, open) {
  const label = labelOf(experiments, cache);
  const chosen = results[results.length - 1];
  const sorted = [...results].sort((one, other) => one.range[0] - other.range[0] || one.range[1] - other.range[1]);
  const isShared = chosen.pairs.some((pair) => pair.shared_streams);
  const hasMargin = chosen.pairs.some((pair) => pair.equivalence);
  /** @type {("student" | "welch" | "mann_whitney" | "paired_t" | "wilcoxon" | "brown_forsythe")[]} */
  const tests = [...UNPAIRED, ...(isShared ? PAIRED : []), "brown_forsythe"];
  const columns = ["Pair", ...sorted.map(({ range }) => (isSeveral(range) ? `Mean of ${rangeText(range)}` : `At ${rangeText(range)}`)),
    `Difference at ${rangeText(chosen.range)} [90 %]`, "d", "P(first > second) [95 %]", "n", ...(hasMargin ? ["Equivalence"] : []),
    ...tests.map((name) => `${TESTS[name].short}, p after Holm`), "Random streams"];
  const rows = chosen.pairs.map((pair, index) => [
    label(pair), ...sorted.map(({ pairs }) => result(pairs[index], test)),
    `${signed(pair.difference)}${interval(pair.lower, pair.upper)}`, signed(pair.effect_size), estimated(pair.improvement),
    pair.shared_streams ? pair.n_paired : `${pair.n_first}, ${pair.n_second}`, ...(hasMargin ? [pair.equivalence?.words ?? "–"] : []),
    ...tests.map((name) => bothProbabilities(pair[name])), pair.streams,
  ]);
  return h("details", { open, class: "pairs every" }, h("summary", {}, EVERY), table("Pairs", columns, rows));
}

/**
 * Return the table of the pairs while it is folded and not loaded.
 *
 * @param {() => void} unfolded
 */
export const foldedPairs = (unfolded) => h("details", { class: "pairs every", ontoggle: unfolded }, h("summary", {}, EVERY), loading());

/**
 * Return the paper's pooled tests over a range; nothing at a single number.
 *
 * @param {Page.CompareView} view
 * @param {Api.Comparison[]} pairs
 * @param {boolean} open whether the table is unfolded
 */
export function pooledTable({ choice: { experiments }, cache }, pairs, open) {
  const label = labelOf(experiments, cache);
  const rows = pairs.flatMap((pair) => (pair.pooled ? [[label(pair), `${pair.pooled.n_first}, ${pair.pooled.n_second}`, signed(pair.pooled.difference),
    signed(pair.pooled.effect_size), ...UNPAIRED.map((name) => bothProbabilities(/** @type {Api.Pooled} */ (pair.pooled)[name]))]] : []));
  if (!rows.length) return null;
  const head = ["Pair", "n", "Difference", "d", ...UNPAIRED.map((name) => `${TESTS[name].short}, p after Holm`)];
  return h("details", { open, class: "pairs pooled" }, h("summary", {}, "The paper’s tests, pooled over the range"),
    h("p", { class: "caution" }, `⚠ ${pairs[0].pooled?.caution}`), table("Pooled", head, rows));
}

/**
 * Return a function that names a pair.
 *
 * @param {string[]} experiments
 * @param {Page.CompareView["cache"]} cache
 */
function labelOf(experiments, cache) {
  const names = cache.namesOf(experiments);
  const one = (/** @type {string} */ id) => `${letter(experiments.indexOf(id))} ${names.get(id)}`;
  return (/** @type {Api.Comparison} */ pair) => `${one(pair.first)} − ${one(pair.second)}`;
}

/**
 * @param {Api.Comparison} pair
 * @param {Page.Comparison["test"]} test
 */
function result(pair, test) {
  const { kind, sign, words } = verdict(pair, test);
  return h("span", { class: kind }, `${sign} ${words}`, kind === "unknown" ? "" : `, ${probability(pair[test].p_holm)}`);
}
