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
  const caption = from === to ? `The row against the column, after ${from} real-world evaluation${from === 1 ? "" : "s"}` : `The row against the column, over ${from} to ${to} real-world evaluations`;
  const head = h("tr", {}, h("td", {}), ...ids.map((id) => h("th", { scope: "col", title: books.name(id) }, short(id))));
  const rows = ids.map((row) => h("tr", {}, h("th", { scope: "row" }, h("b", {}, short(row)), ` ${books.name(row)}`),
    ...ids.map((column) => (row === column ? h("td", { class: "self" }, h("span", { class: "away" }, "itself")) : cell(by.get(`${row} ${column}`), choice.test)))));
  return framed(caption, h("table", { class: "matrix" }, h("caption", {}, caption), h("thead", {}, head), h("tbody", {}, ...rows)));
}

function cell(pair, test) {
  const { kind, sign, words } = verdict(pair, test);
  const numbers = kind === "unknown" ? words : `${probability(pair[test].p_holm)}, d = ${size(pair.effect_size)}`;
  return h("td", { class: kind }, h("span", { class: "verdict" }, h("span", { "aria-hidden": "true" }, `${sign} `), kind === "unknown" ? "" : words), h("small", {}, numbers));
}
