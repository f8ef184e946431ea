/** Every experiment against every other, as one sees at a glance. */

import { h } from "../../lib/dom.js";
import { framed } from "../../lib/table.js";
import { letter } from "./list.js";
import { probability, size, turned, verdict } from "./verdict.js";

/** The matrix over one range: the row against the column. */
export function matrix(view, ids, { range: [from, to], pairs }) {
  const { books, choice } = view;
  const short = (id) => letter(choice.experiments.indexOf(id));
  const by = new Map(pairs.flatMap((each) => [[`${each.first} ${each.second}`, each], [`${each.second} ${each.first}`, turned(each)]]));
  const names = books.names(choice.experiments);
  const range = from === to ? `after ${from} real-world evaluation${from === 1 ? "" : "s"}` : `over ${from} to ${to} real-world evaluations`;
  const title = `The row against the column, ${range}`;
  const head = h("tr", {}, h("td", {}), ...ids.map((id) => h("th", { scope: "col", title: names.get(id) }, short(id))));
  const against = (row, column) => (row === column
    ? h("td", { class: "self" }, h("span", { class: "away" }, "itself"))
    : cell(by.get(`${row} ${column}`), choice.test));
  const rows = ids.map((row) => h("tr", {}, h("th", { scope: "row" }, h("b", {}, short(row)), ` ${names.get(row)}`),
    ...ids.map((column) => against(row, column))));
  const table = h("table", { class: "matrix", "aria-labelledby": "matrix-title" }, h("thead", {}, head), h("tbody", {}, ...rows));
  return [h("p", { class: "note", id: "matrix-title" }, title), framed(title, table)];
}

function cell(pair, test) {
  const { kind, sign, words } = verdict(pair, test);
  if (kind === "unknown") return h("td", { class: kind }, words);
  const signed = h("span", { class: "verdict" }, h("span", { "aria-hidden": "true" }, `${sign} `), words);
  return h("td", { class: kind }, signed, h("small", {}, probability(pair[test].p_holm)), h("small", {}, `d = ${size(pair.effect_size)}`));
}
