/** The figures of an experiment: drawn when they come into sight, and anew as it goes on. */

import { get } from "../../lib/api.js";
import { bandChoice } from "../../lib/bands.js";
import { h } from "../../lib/dom.js";
import { figureFiles } from "../../lib/downloads.js";
import { plot } from "../../lib/plot.js";

const ENDS = ["completed", "failed", "cancelled", "stopped", "extended"];
const OTHERS = [
  ["predictions", "Simulation against reality", ["measured", "tuned", ...ENDS]],
  ["squared-error", "Squared error", ["tuned", ...ENDS]],
  ["simulators", "Tuned simulators", ["tuned", ...ENDS]],
];

/** Whether it is the baseline, which evolves in reality itself: it has no simulators. */
export const isDirect = (experiment) => experiment.strategy === "direct";

/** The curve, and the other figures that such an experiment has. */
export function figures(page) {
  const query = { experiment: page.id };
  const others = isDirect(page.experiment) ? [] : OTHERS.map(([kind, title, kinds]) => card(page, kind, title, kinds, query));
  return { curve: curve(page), others: others.length ? [h("div", { class: "figures" }, ...others)] : [] };
}

function curve(page) {
  const each = h("input", { type: "checkbox" });
  const band = bandChoice();
  const query = () => ({ experiment: page.id, band: band.value, each: each.checked || null });
  const options = h("p", { class: "options" }, h("label", {}, each, " Each repetition"), h("label", {}, "Band ", band));
  const kinds = ["transferred", "probed", "repetition_completed", ...ENDS];
  const csv = ["CSV", `/experiments/${page.id}/curve`, { format: "csv" }, `gaplab-${page.id}-curve.csv`];
  return card(page, "curves", "Fitness in reality", kinds, query, options, csv);
}

function card(page, kind, title, kinds, query, options = null, ...files) {
  const asked = typeof query === "function" ? query : () => query;
  const place = h("div");
  const saved = h("div");
  let refresh = null;
  const draw = async () => {
    saved.replaceChildren(figureFiles(kind, asked(), `gaplab-${page.id}-${kind}`, ...files));
    const isNew = await (refresh ? refresh(asked()) : (refresh = plot(place, kind, asked(), page.signal)).drawn);
    return !isNew || (kind === "predictions" && await isPending(page));
  };
  options?.addEventListener("change", draw);
  page.parts.add(place, kinds, draw);
  return h("section", { class: `card figure-${kind}`, "aria-labelledby": `title-${kind}` },
    h("div", { class: "titled" }, h("h2", { id: `title-${kind}` }, title), options), place, saved);
}

/** Whether predictions are still computed: they are physics, and go on with each question. */
async function isPending({ id, signal }) {
  return (await get(`/experiments/${id}/predictions`, {}, signal)).pending > 0;
}
