/** The figure of the comparison, and its files. */

import { h } from "../../lib/dom.js";
import { figureFiles } from "../../lib/downloads.js";
import { plot } from "../../lib/plot.js";
import { drawing } from "./address.js";

/** Curves with bands, drawn anew when the choice is another or an experiment goes on. */
export function figure(view) {
  const place = h("div", { class: "large" });
  const saved = h("div");
  let key = null;
  let refresh = null;
  const update = (events) => {
    const query = drawing({ ...view.choice, experiments: view.choice.experiments.filter((each) => view.books.get(each)) });
    const now = JSON.stringify(query);
    if (!query.experiment.length || (key === now && !events.length)) return;
    if (key !== now) {
      const csv = ["CSV", "/curves", { experiment: query.experiment, format: "csv" }, "gaplab-curves.csv"];
      saved.replaceChildren(figureFiles("curves", query, "gaplab-curves", csv));
    }
    key = now;
    if (refresh) refresh(query);
    else refresh = plot(place, "curves", query, view.signal);
  };
  return { element: h("section", { class: "card", "aria-label": "Curves" }, place, saved), update };
}
