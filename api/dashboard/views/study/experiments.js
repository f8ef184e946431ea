// @ts-check
/** The experiments of a study, in rows like those of the list. */

import { h } from "../../lib/dom.js";
import { keyedRows } from "../../lib/keyed_rows.js";
import { experimentRow, headCells } from "../list/rows.js";
import { selectionBar } from "../list/selection.js";

/** @typedef {import("../list/rows.js").ExperimentItem} ExperimentItem */

/**
 * Return the table of the experiments.
 *
 * @param {Page.StudyPage} page
 * @returns {Page.Updatable}
 */
export function experiments(page) {
  const body = h("tbody");
  const bar = selectionBar(() => update());
  const ticked = () => {
    bar.update();
    update();
  };
  const makeRow = (/** @type {ExperimentItem} */ item) => experimentRow(item, { unit: page.unit, ticked });
  const fill = keyedRows(body, (/** @type {ExperimentItem} */ { value }) => value.id, makeRow);
  const update = () => fill(page.study.experiments.map((value) => ({ value, isNested: true })));
  const table = h("table", { class: "list flat" }, h("caption", { class: "away" }, "Experiments"), h("thead", {}, h("tr", {}, ...headCells())), body);
  update();
  const title = h("h2", { id: "experiments-title" }, "Experiments");
  return { element: h("section", { "aria-labelledby": "experiments-title" }, title, bar.element, table), update };
}
