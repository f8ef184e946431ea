/** Tables that scroll sideways in their own frame, so that no page does. */

import { h } from "./dom.js";

/** A table with a caption for those who do not see it; a cell is text or an element, the first of a row is its head. */
export function table(caption, columns, rows) {
  const head = h("tr", {}, ...columns.map((each) => h("th", { scope: "col" }, each)));
  return framed(caption, h("table", {}, h("caption", { class: "away" }, caption), h("thead", {}, head),
    h("tbody", {}, ...rows.map((cells) => h("tr", {}, ...cells.map((cell, at) => at ? h("td", {}, cell) : h("th", { scope: "row" }, cell)))))));
}

/** A frame that scrolls, also by the keyboard. */
export const framed = (label, ...content) => h("div", { class: "framed", role: "region", "aria-label": label, tabindex: "0" }, ...content);
