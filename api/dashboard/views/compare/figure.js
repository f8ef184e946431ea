// @ts-check
/** The figure of the comparison, and its files. */

import { h } from "../../lib/dom.js";
import { figureDownloads } from "../../lib/downloads.js";
import { CURVE_KINDS } from "../../lib/event_kinds.js";
import { plot } from "../../lib/plot.js";
import { figureQuery } from "./address.js";

/**
 * Return the curves, which are drawn again after another choice or an event.
 *
 * @param {Page.CompareView} view
 * @returns {Page.ComparePart}
 */
export function figure(view) {
  const place = h("div", { class: "large" });
  const downloads = h("div");
  const draw = plot(place, "curves", view.signal);
  let lastKey = "";
  const queryNow = () => figureQuery({ ...view.choice, experiments: view.cache.known(view.choice.experiments) });
  const load = async () => {
    const query = queryNow();
    return !query.study.length || await draw(query) ? undefined : "failed";
  };
  const loadNow = view.sections.add(place, CURVE_KINDS, load);
  const update = () => {
    const query = queryNow();
    const key = JSON.stringify(query);
    if (key === lastKey || !query.study.length) return;
    lastKey = key;
    downloads.replaceChildren(figureDownloads("curves", query, "gaplab-curves",
      ["CSV", "/curves", { study: query.study, fitness: query.fitness, format: "csv" }, "gaplab-curves.csv"]));
    loadNow();
  };
  return { element: h("section", { class: "card", "aria-label": "Curves" }, place, downloads), update };
}
