/** How far tuned simulators are from reality, and from each other when tuning is repeated. */

import { get } from "../../lib/api.js";
import { h } from "../../lib/dom.js";
import { spoken } from "../../lib/format.js";
import { empty } from "../../lib/states.js";
import { table } from "../../lib/table.js";

const KINDS = ["tuned", "probed"];

/** What the service remarks on it, and a line for each iteration. */
export function misfit(page) {
  const place = h("div");
  page.parts.add(place, KINDS, async () => {
    const { points, remarks, unit } = await get(`/experiments/${page.id}/misfit`, {}, page.signal);
    if (!points.length) {
      place.replaceChildren(empty("Nothing was tuned yet."));
      return;
    }
    const names = points[0].tunables.map((each) => each.name);
    const note = "Mean ± SD over repetitions. ⊣ and ⊢: a share of them is stuck at the lower or the upper bound. Iteration 0 is not tuned.";
    const columns = ["Iteration", `Error on its samples (${unit})`, `Gap of what it evolved (${unit})`, ...names.map(spoken), "n"];
    place.replaceChildren(h("ul", { class: "said-of-it" }, ...remarks.map((each) => h("li", {}, each))),
      table("Misfit by iteration", columns, points.map(row)), h("p", { class: "note" }, note));
  });
  return [place];
}

function row(point) {
  const tuned = point.tunables.map((each) => `${spread(each)}${bound(each.at_lower, "⊣")}${bound(each.at_upper, "⊢")}`);
  return [String(point.iteration), spread(point.error), spread(point.gap), ...tuned, String(point.gap.n)];
}

const spread = ({ mean, sd }) => (mean === null ? "–" : `${small(mean)}${sd === null ? "" : ` ± ${small(sd)}`}`);

const bound = (share, sign) => (share ? ` ${sign} ${Math.round(100 * share)} %` : "");

const small = (value) => String(Number(value.toPrecision(3))).replace("-", "−");
