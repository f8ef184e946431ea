// @ts-check
/** The figures of an experiment: drawn when they come into sight, and again as it continues. */

import { get } from "../../lib/api.js";
import { curveOptions } from "../../lib/curve_options.js";
import { h } from "../../lib/dom.js";
import { figureDownloads } from "../../lib/downloads.js";
import { plot } from "../../lib/plot.js";
import { CURVE_KINDS, FIGURE_KINDS } from "./event_words.js";

/**
 * @typedef {object} Figure
 * @property {string} kind
 * @property {string} title
 * @property {string[]} events the kinds of events that change it
 * @property {(page: Page.ExperimentPage) => Promise<boolean>} [isPending] whether the service is still computing it
 */

/** @type {Figure} */
const CURVE = { kind: "curves", title: "Fitness in reality", events: CURVE_KINDS };

/** @type {Figure[]} */
const OTHERS = [
  { kind: "predictions", title: "Simulation against reality", events: ["measured", "tuned", ...FIGURE_KINDS], isPending: arePredictionsPending },
  { kind: "squared-error", title: "Error of the best simulator", events: ["tuned", ...FIGURE_KINDS] },
  { kind: "simulators", title: "Tuned simulators", events: ["tuned", ...FIGURE_KINDS] },
  { kind: "coordinates", title: "Simulators in parallel coordinates", events: ["tuned", "probed", ...FIGURE_KINDS] },
];

/**
 * Return the curve with its options.
 *
 * @param {Page.ExperimentPage} page
 */
export function curve(page) {
  return card(page, CURVE, curveOptions(), ({ fitness }) =>
    [["CSV", `/experiments/${page.id}/curve`, { format: "csv", fitness }, `gaplab-${page.id}-curve.csv`]]);
}

/**
 * Return the figures about simulators; an experiment without samples has none.
 *
 * @param {Page.ExperimentPage} page
 */
export const otherFigures = (page) =>
  (page.experiment.level ? [] : [h("div", { class: "figures" }, ...OTHERS.map((figure) => card(page, figure)))]);

/**
 * @param {Page.ExperimentPage} page
 * @param {Figure} figure
 * @param {{ element: HTMLElement, query: () => Page.Query } | null} [options]
 * @param {(query: Page.Query) => Parameters<typeof figureDownloads>[3][]} [files]
 */
function card(page, { kind, title, events, isPending }, options = null, files = () => []) {
  const place = h("div");
  const downloads = h("div");
  const drawPlot = plot(place, kind, page.signal);
  const draw = async () => {
    const query = { experiment: page.id, ...options?.query() };
    downloads.replaceChildren(figureDownloads(kind, query, `gaplab-${page.id}-${kind}`, ...files(query)));
    const wasPending = await isPending?.(page); // asked first: the answer continues the computation, so the figure has all that it counts
    const isCurrent = await drawPlot(query);
    if (!isCurrent) return "failed";
    return wasPending ? "pending" : undefined;
  };
  const drawNow = page.sections.add(place, events, draw);
  options?.element.addEventListener("change", drawNow);
  return h("section", { class: `card figure-${kind}`, "aria-labelledby": `title-${kind}` },
    h("div", { class: "titled" }, h("h2", { id: `title-${kind}` }, title), options?.element), place, downloads);
}

/**
 * Return whether predictions are still computed: they are physics, and each question continues them.
 *
 * @param {Page.ExperimentPage} page
 */
async function arePredictionsPending({ id, signal }) {
  return (await get(`/experiments/${id}/predictions`, {}, signal)).pending > 0;
}
