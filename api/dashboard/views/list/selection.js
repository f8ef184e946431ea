// @ts-check
/** The experiments that are ticked for a comparison; they stay ticked while the reader visits other parts of the page. */

import { h } from "../../lib/dom.js";

/** @type {Set<string>} */
const ticked = new Set();

/**
 * Return the bar that leads to the comparison.
 *
 * @param {() => void} cleared called when the bar has unticked all
 * @returns {Page.Updatable}
 */
export function selectionBar(cleared) {
  const text = h("span", { role: "status" });
  const compare = h("a", { class: "button" }, "Compare");
  const clear = () => {
    ticked.clear();
    update();
    cleared();
  };
  const button = h("button", { type: "button", class: "quiet", onclick: clear }, "Clear");
  const element = h("div", { class: "selection", role: "region", "aria-label": "Selected experiments", hidden: true }, text, compare, button);
  const update = () => {
    element.hidden = ticked.size === 0;
    text.textContent = ticked.size ? `${ticked.size} selected` : "";
    compare.href = `#/compare?experiments=${[...ticked].join(",")}`;
  };
  update();
  return { element, update };
}

/**
 * Return a box that ticks several experiments; it is half ticked while only some of them are.
 *
 * @param {string} label
 * @param {() => void} changed
 * @returns {Page.Updatable<string[]>}
 */
export function tickBox(label, changed) {
  /** @type {string[]} */
  let ids = [];
  const tick = () => {
    for (const id of ids) ticked[box.checked ? "add" : "delete"](id);
    changed();
  };
  const box = h("input", { type: "checkbox", "aria-label": label, onchange: tick });
  const update = (/** @type {string[]} */ newIds) => {
    ids = newIds;
    const tickedCount = ids.filter((id) => ticked.has(id)).length;
    box.checked = ids.length > 0 && tickedCount === ids.length;
    box.indeterminate = tickedCount > 0 && tickedCount < ids.length;
  };
  return { element: box, update };
}
