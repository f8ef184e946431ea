// @ts-check
/** Tables that scroll sideways in a frame of their own, so that no page does, and lists of facts. */

import { h } from "./dom.js";

/**
 * Return a table in a frame; the first cell of each row is its head.
 * @param {string} caption for screen readers
 * @param {Page.Child[]} columns
 * @param {Page.Child[][]} rows
 */
export function table(caption, columns, rows) {
  const head = h("tr", {}, ...columns.map((column) => h("th", { scope: "col" }, column)));
  const body = rows.map(([first, ...cells]) => h("tr", {}, h("th", { scope: "row" }, first), ...cells.map((cell) => h("td", {}, cell))));
  return framed(caption, h("table", {}, h("caption", { class: "away" }, caption), h("thead", {}, head), h("tbody", {}, ...body)));
}

/** Return a frame that scrolls, also by keyboard. @param {string} label @param {...Page.Child} content */
export const framed = (label, ...content) => h("div", { class: "framed", role: "region", "aria-label": label, tabindex: "0" }, ...content);

/** @typedef {[name: string, value: string | number]} Fact */

/** Return facts as the items of a list. @param {Fact[]} facts */
export const factItems = (facts) => facts.map(([name, value]) => h("div", {}, h("dt", {}, name), h("dd", {}, value)));
