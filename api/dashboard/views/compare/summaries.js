// @ts-check
/** Each experiment over the chosen range, with intervals. */

import { h } from "../../lib/dom.js";
import { threeDigits } from "../../lib/format.js";
import { table } from "../../lib/table.js";
import { letter } from "./ranges.js";
import { estimated } from "./verdict.js";

/**
 * Return a table of the experiments: mean, interquartile mean and standard deviation.
 *
 * @param {Page.CompareView} view
 * @param {Api.Comparison[]} pairs
 * @param {boolean} open whether the table is unfolded
 */
export function summaries({ choice: { experiments }, cache }, pairs, open) {
  const names = cache.namesOf(experiments);
  const found = new Map(pairs.flatMap((pair) => [[pair.first, pair.summary_first], [pair.second, pair.summary_second]]));
  const rows = experiments.flatMap((id, index) => {
    const one = found.get(id);
    return one ? [[`${letter(index)} ${names.get(id)}`, String(one.n), estimated(one.mean), estimated(one.interquartile_mean), threeDigits(one.sd)]] : [];
  });
  const head = ["Experiment", "n", "Mean [95 %]", "Interquartile mean [95 %]", "SD"];
  return h("details", { open, class: "pairs each" }, h("summary", {}, "Each experiment, with intervals"), table("Each experiment", head, rows));
}
