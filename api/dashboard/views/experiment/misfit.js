// @ts-check
/** How far tuned simulators are from reality, and from each other when tuning is repeated. */

import { get } from "../../lib/api.js";
import { h } from "../../lib/dom.js";
import { readableName } from "../../lib/format.js";
import { empty } from "../../lib/placeholders.js";
import { table } from "../../lib/table.js";

const KINDS = ["tuned", "probed"];
const NOTE = "The error per sample is the root mean square over the samples. Mean ± SD over repetitions. ⊣ and ⊢ give the share of repetitions whose value is at the lower or the upper bound. Iteration 0 is not tuned.";

/**
 * Return the service's remarks, and a table with a row for each iteration.
 *
 * @param {Page.ExperimentPage} page
 */
export function misfit(page) {
  const place = h("div");
  page.sections.add(place, KINDS, async () => {
    /** @type {Api.MisfitRead} */
    const { points, remarks, unit } = await get(`/experiments/${page.id}/misfit`, {}, page.signal);
    if (!points.length) {
      place.replaceChildren(empty("Nothing is tuned yet."));
      return;
    }
    const tunables = points[0].tunables.map(({ name }) => readableName(name));
    const columns = ["Iteration", `Error per sample (${unit})`, `Gap of what it evolved (${unit})`, ...tunables, "n"];
    place.replaceChildren(h("ul", { class: "misfit-remarks" }, ...remarks.map((remark) => h("li", {}, remark))),
      table("Misfit by iteration", columns, points.map(row)), h("p", { class: "note" }, NOTE));
  });
  return [place];
}

/** @param {Api.MisfitPoint} point */
function row({ iteration, error, gap, tunables }) {
  const tuned = tunables.map((tunable) => `${meanAndSd(tunable)}${boundShare(tunable.at_lower, "⊣")}${boundShare(tunable.at_upper, "⊢")}`);
  return [iteration, meanAndSd(error), meanAndSd(gap), ...tuned, gap.n];
}

/** @param {Api.Distribution} distribution */
const meanAndSd = ({ mean, sd }) => (mean === null ? "–" : `${threeDigits(mean)}${sd === null ? "" : ` ± ${threeDigits(sd)}`}`);

/** @type {(share: number | null, sign: string) => string} */
const boundShare = (share, sign) => (share ? ` ${sign} ${Math.round(100 * share)} %` : "");

/** @param {number} value */
const threeDigits = (value) => String(Number(value.toPrecision(3))).replace("-", "−");
