// @ts-check
/** Every pair with every test, and where along the curve it differs. */

import { h } from "../../lib/dom.js";
import { table } from "../../lib/table.js";
import { TESTS } from "./address.js";
import { isPooled, letter, rangeText } from "./ranges.js";
import { probability, signed, verdict } from "./verdict.js";

const NAMES = /** @type {Page.Comparison["test"][]} */ (Object.keys(TESTS));

/**
 * Return a table of the pairs: each range by the chosen test, and the numbers of the last range by all tests.
 *
 * @param {Page.CompareView} view
 * @param {Page.RangeResult[]} results
 * @param {boolean} open whether the table is unfolded
 */
export function pairsTable({ choice: { test, experiments }, cache }, results, open) {
  const names = cache.namesOf(experiments);
  const label = (/** @type {string} */ id) => `${letter(experiments.indexOf(id))} ${names.get(id)}`;
  const chosen = results[results.length - 1];
  const sorted = [...results].sort((one, other) => one.range[0] - other.range[0] || one.range[1] - other.range[1]);
  const columns = ["Pair", ...sorted.map(({ range }) => (isPooled(range) ? `Pooled ${rangeText(range)}, p too small` : `At ${rangeText(range)}`)), `Difference at ${rangeText(chosen.range)}`, "d", "n",
    ...NAMES.map((name) => `${TESTS[name].short}, p after Holm`)];
  const rows = chosen.pairs.map((pair, index) => [
    `${label(pair.first)} − ${label(pair.second)}`,
    ...sorted.map(({ pairs }) => result(pairs[index], test)),
    signed(pair.difference), signed(pair.effect_size), `${pair.n_first}, ${pair.n_second}`,
    ...NAMES.map((name) => probability(pair[name].p_holm)),
  ]);
  return h("details", { open, class: "pairs" }, h("summary", {}, "Every pair, at every range, by every test"), table("Pairs", columns, rows));
}

/**
 * @param {Api.Comparison} pair
 * @param {Page.Comparison["test"]} test
 */
function result(pair, test) {
  const { kind, sign, words } = verdict(pair, test);
  return h("span", { class: kind }, `${sign} ${words}`, kind === "unknown" ? "" : `, ${probability(pair[test].p_holm)}`);
}
