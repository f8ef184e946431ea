/** The experiments that were ticked, to be compared; they stay ticked while one looks at other pages of the list. */

import { h } from "../../lib/dom.js";

const chosen = new Set();

/** Whether it is ticked. */
export const isChosen = (id) => chosen.has(id);

/** Tick these, or not. */
export function choose(ids, on) {
  for (const id of ids) chosen[on ? "add" : "delete"](id);
}

/** The bar that leads to the comparison, and `update()` for when others are ticked; `changed()` is called when it unticks all. */
export function selectionBar(changed) {
  const words = h("span", { role: "status" });
  const go = h("a", { class: "button" }, "Compare");
  const clear = h("button", { type: "button", class: "quiet", onclick: () => { chosen.clear(); update(); changed(); } }, "Clear");
  const element = h("div", { class: "selection", role: "region", "aria-label": "Selected experiments", hidden: true }, words, go, clear);
  const update = () => {
    element.hidden = chosen.size === 0;
    words.textContent = chosen.size ? `${chosen.size} selected` : "";
    go.href = `#/compare?experiments=${[...chosen].join(",")}`;
  };
  update();
  return { element, update };
}

/** A tick box for these experiments: of some of them it is half ticked. */
export function tick(label, changed) {
  let ids = [];
  const box = h("input", { type: "checkbox", "aria-label": label, onchange: () => { choose(ids, box.checked); changed(); } });
  const update = (now) => {
    ids = now;
    const on = ids.filter(isChosen).length;
    box.checked = ids.length > 0 && on === ids.length;
    box.indeterminate = on > 0 && on < ids.length;
  };
  return { element: box, update };
}
