/** The experiments of a study, as rows of the same list as on the first page. */

import { h } from "../../lib/dom.js";
import { rows } from "../../lib/rows.js";
import { experimentRow, heads } from "../list/rows.js";
import { selectionBar } from "../list/selection.js";

/** The table, and `update()` for when `page.study` is another. */
export function experiments(page) {
  const body = h("tbody");
  const bar = selectionBar(() => update());
  const list = { unit: page.unit, ticked: () => { bar.update(); update(); } };
  const fill = rows(body, (each) => each.value.id, (each) => experimentRow(each, list));
  const update = () => fill(page.study.experiments.map((value) => ({ value, nested: true })));
  const table = h("table", { class: "list flat" }, h("caption", { class: "away" }, "Experiments"), h("thead", {}, h("tr", {}, ...heads())), body);
  update();
  return { element: h("section", { "aria-labelledby": "experiments-of" }, h("h2", { id: "experiments-of" }, "Experiments"), bar.element, table), update };
}
