// @ts-check
/** The figure of the comparison, and its files. */

import { h } from "../../lib/dom.js";
import { figureDownloads } from "../../lib/downloads.js";
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
  const update = (/** @type {unknown[]} */ events) => {
    const query = figureQuery({ ...view.choice, experiments: view.cache.known(view.choice.experiments) });
    const key = JSON.stringify(query);
    if (!query.experiment.length || (key === lastKey && !events.length)) return;
    if (key !== lastKey) {
      downloads.replaceChildren(figureDownloads("curves", query, "gaplab-curves",
        ["CSV", "/curves", { experiment: query.experiment, format: "csv" }, "gaplab-curves.csv"]));
    }
    lastKey = key;
    draw(query);
  };
  return { element: h("section", { class: "card", "aria-label": "Curves" }, place, downloads), update };
}
