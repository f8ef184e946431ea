// @ts-check
/** The figures of a study and of an experiment: drawn when they come into sight, and again as it continues. */

import { get } from "../../lib/api.js";
import { curveOptions } from "../../lib/curve_options.js";
import { h } from "../../lib/dom.js";
import { figureDownloads } from "../../lib/downloads.js";
import { CURVE_KINDS, FIGURE_KINDS } from "../../lib/event_kinds.js";
import { plot } from "../../lib/plot.js";

/**
 * @typedef {object} Figure
 * @property {string} kind
 * @property {"study"} [of] named by a study; the others by an experiment
 * @property {string} title
 * @property {string[]} events the kinds of events that change it
 * @property {(page: Page.StudyPage) => Promise<boolean>} [isPending] whether the service is still computing it
 */

/** @type {Figure[]} */
const OTHERS = [
  { kind: "predictions", title: "Simulation against reality", events: ["measured", "tuned", ...FIGURE_KINDS], isPending: arePredictionsPending },
  { kind: "squared-error", title: "Error of the best simulator", events: ["tuned", ...FIGURE_KINDS] },
  { kind: "simulators", title: "Tuned simulators", events: ["tuned", ...FIGURE_KINDS] },
  { kind: "coordinates", of: "study", title: "Simulators in parallel coordinates", events: ["tuned", "probed", ...FIGURE_KINDS] },
];

/** Return the curves with their options, as in the paper's Fig. 4. @param {Page.StudyPage} page */
export const curves = (page) => card(page, { kind: "curves", of: "study", title: "Fitness in reality", events: CURVE_KINDS }, curveOptions());

/** Return the figures about the simulators of one experiment; without samples it has none. @param {Page.StudyPage} page */
export const otherFigures = (page) =>
  (page.experiment.level ? [] : [h("div", { class: "figures" }, ...OTHERS.map((figure) => card(page, figure)))]);

/** @param {Page.StudyPage} page @param {Figure} figure @param {{ element: HTMLElement, query: () => Page.Query } | null} [options] */
function card(page, { kind, of, title, events, isPending }, options = null) {
  const [place, downloads] = [h("div"), h("div")];
  const drawPlot = plot(place, kind, page.signal);
  const draw = async () => {
    /** @type {Page.Query} */
    const query = { ...(of ? { study: page.id } : { experiment: page.experiment.id }), ...options?.query() };
    const name = `gaplab-${page.id}-${kind}`;
    /** @type {Parameters<typeof figureDownloads>[3][]} */
    const files = options ? [["CSV", "/curves", { study: page.id, format: "csv", fitness: query.fitness }, `${name}.csv`]] : [];
    downloads.replaceChildren(figureDownloads(kind, query, name, ...files));
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

/** Return whether predictions are still computed: they are physics, and each question continues them. @param {Page.StudyPage} page */
async function arePredictionsPending({ experiment: { id }, signal }) {
  return (await get(`/experiments/${id}/predictions`, {}, signal)).pending > 0;
}
