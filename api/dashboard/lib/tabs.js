/** Tabs, as the ARIA practices have them: arrows, Home and End move, and the chosen one is in the address. */

import { h } from "./dom.js";

const STEPS = { ArrowRight: 1, ArrowLeft: -1 };

/**
 * Tabs over panels, `[[name, words, panel], …]`; one whose name is `chosen` is open at first. `changed(name)` is told
 * of every other choice.
 */
export function tabs(label, entries, chosen, changed) {
  const buttons = entries.map(([name, words]) =>
    h("button", { type: "button", role: "tab", id: `tab-${name}`, "aria-controls": `panel-${name}`, onclick: () => choose(name, true) }, words));
  const panels = entries.map(([name, , panel]) =>
    h("div", { role: "tabpanel", id: `panel-${name}`, "aria-labelledby": `tab-${name}`, tabindex: "0" }, panel));
  const names = entries.map(([name]) => name);

  function choose(name, told) {
    names.forEach((each, at) => {
      buttons[at].setAttribute("aria-selected", String(each === name));
      buttons[at].tabIndex = each === name ? 0 : -1;
      panels[at].hidden = each !== name;
    });
    if (told) changed(name);
  }

  function move(event) {
    const at = buttons.indexOf(event.target);
    const to = { Home: 0, End: names.length - 1 }[event.key] ?? (event.key in STEPS ? at + STEPS[event.key] : null);
    if (to === null) return;
    event.preventDefault();
    const next = (to + names.length) % names.length;
    choose(names[next], true);
    buttons[next].focus();
  }

  choose(names.includes(chosen) ? chosen : names[0], false);
  return h("div", { class: "tabs" }, h("div", { role: "tablist", "aria-label": label, onkeydown: move }, ...buttons), ...panels);
}
