// @ts-check
/** A study, live: its progress, its curves, its experiments, and the actions on all of them. */

import { get, getTagged } from "../lib/api.js";
import { curveOptions } from "../lib/curve_options.js";
import { h } from "../lib/dom.js";
import { figureDownloads } from "../lib/downloads.js";
import { follow, reloadEvery } from "../lib/live.js";
import { plot } from "../lib/plot.js";
import { unitsOf } from "../lib/robots.js";
import { experiments } from "./study/experiments.js";
import { head } from "./study/head.js";
import { snippets } from "./study/snippets.js";

const RELOAD_MS = 15_000;
const CURVE_KINDS = new Set(["probed", "completed", "failed", "cancelled", "extended", "imported"]);

/**
 * Fill `root` with the study that the parameters name, until `signal`.
 *
 * @param {HTMLElement} root
 * @param {URLSearchParams} parameters
 * @param {AbortSignal} signal
 */
export async function show(root, parameters, signal) {
  const id = String(parameters.get("id"));
  const { latest } = await get("/events/page", { limit: 1 }, signal);
  const [loaded, catalogue] = await Promise.all([getTagged(`/studies/${id}`, signal), get("/catalogue", {}, signal)]);
  /** @type {Page.StudyPage} */
  const page = {
    id, signal, study: loaded.value, tag: loaded.tag, unit: unitsOf(catalogue),
    take({ value, tag }) {
      Object.assign(page, { study: value, tag });
      top.update();
      table.update();
    },
    reload: async () => page.take(await getTagged(`/studies/${id}`, signal)),
  };
  const top = head(page);
  const table = experiments(page);
  const figure = curves(page);
  root.replaceChildren(top.element, figure.element, table.element, snippets(page));
  follow({ study: id, after: latest }, async (events) => {
    if (!events.length || events.some(({ kind }) => CURVE_KINDS.has(kind))) figure.update();
    await page.reload();
  }, signal);
  reloadEvery(page, RELOAD_MS);
}

/**
 * Return the figure of the curves with its options, as in the paper's Fig. 4.
 *
 * @param {Page.StudyPage} page
 * @returns {Page.Updatable}
 */
function curves({ id, signal }) {
  const place = h("div");
  const draw = plot(place, "curves", signal);
  const options = curveOptions();
  const update = () => { draw({ study: id, ...options.query() }); };
  options.element.addEventListener("change", update);
  update();
  const csv = /** @type {const} */ (["CSV", `/studies/${id}/curves`, { format: "csv" }, `gaplab-${id}-curves.csv`]);
  const element = h("section", { class: "card", "aria-labelledby": "curves-title" },
    h("div", { class: "titled" }, h("h2", { id: "curves-title" }, "Curves"), options.element), place,
    figureDownloads("curves", { study: id }, `gaplab-${id}-curves`, [...csv]));
  return { element, update };
}
