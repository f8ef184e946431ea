// @ts-check
/** Every experiment against every other, at a glance. */

import { h } from "../../lib/dom.js";
import { threeDigits } from "../../lib/format.js";
import { framed } from "../../lib/table.js";
import { letter } from "./ranges.js";
import { probabilities, signed, swapped, verdict } from "./verdict.js";

/**
 * Return the matrix over one range: the row against the column.
 *
 * @param {Page.CompareView} view
 * @param {string[]} ids
 * @param {Page.RangeResult} result
 */
export function matrix({ cache, choice }, ids, { pairs }) {
  const letterOf = (/** @type {string} */ id) => letter(choice.experiments.indexOf(id));
  const names = cache.namesOf(choice.experiments);
  const pairsByIds = new Map([...pairs, ...pairs.map(swapped)].map((pair) => [`${pair.first} ${pair.second}`, pair]));
  const title = `The row against the column, ${pairs[0].where}`;
  const head = h("tr", {}, h("td", {}), ...ids.map((id) => h("th", { scope: "col", title: names.get(id) }, letterOf(id))));
  const rows = ids.map((row) => h("tr", {}, h("th", { scope: "row" }, h("b", {}, letterOf(row)), ` ${names.get(row)}`),
    ...ids.map((column) => cell(pairsByIds.get(`${row} ${column}`), choice.test))));
  const table = h("table", { class: "matrix", "aria-labelledby": "matrix-title" }, h("thead", {}, head), h("tbody", {}, ...rows));
  return [h("p", { class: "note", id: "matrix-title" }, title), framed(title, table)];
}

/**
 * @param {Api.Comparison | undefined} pair missing where an experiment meets itself
 * @param {Page.Comparison["test"]} test
 */
function cell(pair, test) {
  if (!pair) return h("td", { class: "self" }, h("span", { class: "away" }, "itself"));
  const { kind, sign, words } = verdict(pair, test);
  if (kind === "unknown") return h("td", { class: kind }, words);
  const result = h("span", { class: "verdict" }, h("span", { "aria-hidden": "true" }, `${sign} `), words);
  const { equivalence } = pair;
  const within = equivalence?.verdict === "equivalent" && h("small", { class: "within", title: equivalence.words }, `≡ within ±${threeDigits(equivalence.margin)}`);
  const paired = test === "trusted" && pair.shared_streams && h("small", { title: pair.streams }, "paired");
  return h("td", { class: kind }, result, ...probabilities(pair[test]).map((words) => h("small", {}, words)), h("small", {}, `d = ${signed(pair.effect_size)}`), paired, within);
}
