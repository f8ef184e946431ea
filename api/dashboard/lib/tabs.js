// @ts-check
/** Tabs by the ARIA practices: the arrow keys, Home and End move between them. */

import { h } from "./dom.js";

/** @type {Record<string, number>} */
const STEPS = { ArrowRight: 1, ArrowLeft: -1 };

/**
 * Return tabs over panels.
 * @param {string} label
 * @param {[name: string, title: string, panel: Page.Child][]} entries
 * @param {string | null} chosen the name of the panel that is open at first; the first one if there is none of that name
 * @param {(name: string) => void} changed called with the name of each other choice
 */
export function tabs(label, entries, chosen, changed) {
  const names = entries.map(([name]) => name);
  const buttons = entries.map(([name, title]) => {
    const press = () => {
      choose(name);
      changed(name);
    };
    return h("button", { type: "button", role: "tab", id: `tab-${name}`, "aria-controls": `panel-${name}`, onclick: press }, title);
  });
  const panels = entries.map(([name, , panel]) =>
    h("div", { role: "tabpanel", id: `panel-${name}`, "aria-labelledby": `tab-${name}`, tabindex: "0" }, panel));

  /** @param {string} chosenName */
  function choose(chosenName) {
    names.forEach((name, index) => {
      buttons[index].setAttribute("aria-selected", String(name === chosenName));
      buttons[index].tabIndex = name === chosenName ? 0 : -1;
      panels[index].hidden = name !== chosenName;
    });
  }

  /** @param {KeyboardEvent} event */
  function move(event) {
    const from = buttons.indexOf(/** @type {HTMLButtonElement} */ (event.target));
    const ends = /** @type {Record<string, number>} */ ({ Home: 0, End: names.length - 1 });
    if (!(event.key in ends) && !(event.key in STEPS)) return;
    event.preventDefault();
    const to = buttons[(ends[event.key] ?? from + STEPS[event.key] + names.length) % names.length];
    to.click();
    to.focus();
  }

  choose(chosen !== null && names.includes(chosen) ? chosen : names[0]);
  return h("div", { class: "tabs" }, h("div", { role: "tablist", "aria-label": label, onkeydown: move }, ...buttons), ...panels);
}
