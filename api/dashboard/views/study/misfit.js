// @ts-check
/** How far tuned simulators are from reality and from each other, and which tunables that identifies. */

import { get } from "../../lib/api.js";
import { h } from "../../lib/dom.js";
import { downloadLink } from "../../lib/downloads.js";
import { REWRITES } from "../../lib/event_kinds.js";
import { readableName } from "../../lib/format.js";
import { empty } from "../../lib/placeholders.js";
import { table } from "../../lib/table.js";

const KINDS = ["tuned", "probed", ...REWRITES];
const NOTE = "Mean ± SD over repetitions, and the share of repetitions whose value is at a bound.";
const RANDOM = " Simulators tuned on no sample are random.";

/** Return the verdicts on tunables, the service's remarks, and a table with a row for each iteration. @param {Page.StudyPage} page */
export function misfit(page) {
  const place = h("div");
  const { id } = page.experiment;
  page.sections.add(place, KINDS, async () => {
    /** @type {Api.MisfitRead} */
    const { points, remarks, unit, error_unit: errorUnit, verdicts, held_out: share, note } = await get(`/experiments/${id}/misfit`, {}, page.signal);
    if (!points.length) {
      place.replaceChildren(empty("Nothing is tuned yet."));
      return;
    }
    const tunables = points[0].tunables.map(({ name }) => readableName(name));
    const unseen = share ? [`On held-out samples (${errorUnit})`] : [];
    const columns = ["Iteration", `Error per sample (${errorUnit})`, ...unseen, `Gap of what it evolved (${unit})`, ...tunables, "n"];
    place.replaceChildren(...identified(verdicts, note), h("h3", {}, "Misfit"),
      h("ul", { class: "misfit-remarks" }, ...remarks.map((remark) => h("li", {}, remark))),
      table("Misfit by iteration", columns, points.map((point) => row(point, Boolean(share)))), h("p", { class: "note" }, NOTE, points[0].error.n ? "" : RANDOM,
        " ", downloadLink("CSV", `/experiments/${id}/misfit`, { format: "csv" }, `gaplab-${id}-misfit.csv`)));
  });
  return [place];
}

/** Return the verdict on each tunable, and what would help; nothing before the first sample. @param {Api.TunableVerdict[]} verdicts @param {string} note */
function identified(verdicts, note) {
  if (!verdicts.length) return [];
  const rows = verdicts.map(({ name, verdict, remaining, helps }) => [
    readableName(name), h("span", { class: `verdict ${verdict.replaceAll(" ", "-")}` }, verdict),
    remaining === null ? "–" : `${Math.round(100 * remaining)} %`,
    helps.length ? h("ul", { class: "helps" }, ...helps.map((help) => h("li", {}, help))) : "–",
  ]);
  return [h("h3", {}, "Which tunables are identified"),
    table("Which tunables are identified", ["Tunable", "Verdict", "Uncertainty left", "What would help"], rows),
    h("p", { class: "note" }, note)];
}

/** @type {(point: Api.MisfitPoint, hasUnseen: boolean) => Page.Child[]} */
function row({ iteration, error, held_out_error: unseen, gap, tunables }, hasUnseen) {
  const tuned = tunables.map(({ text, at_bounds: atBounds }) => [text, atBounds].filter(Boolean).join(", "));
  return [iteration, error.text, ...(hasUnseen ? [unseen.text] : []), gap.text, ...tuned, gap.n || error.n];
}
