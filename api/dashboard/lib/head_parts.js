// @ts-check
/** Parts of the head of a study and of an experiment. */

import { h } from "./dom.js";

/** @typedef {[name: string, value: string | number]} Fact */
/** @typedef {{ text: string, note?: string }} Remark */

/**
 * Return facts as the items of a list.
 *
 * @param {Fact[]} facts
 */
export const factItems = (facts) => facts.map(([name, value]) => h("div", {}, h("dt", {}, name), h("dd", {}, value)));

/**
 * Return warnings, and the reasons why repetitions failed; nothing where there are none.
 *
 * @param {Remark[]} warnings
 * @param {Remark[]} reasons
 */
export const remarkBlocks = (warnings, reasons) => [
  ...remarkBlock("Warnings", "warned", warnings), ...remarkBlock("Why repetitions failed", "broken", reasons)];

/**
 * @param {string} title
 * @param {string} cssClass
 * @param {Remark[]} remarks
 */
function remarkBlock(title, cssClass, remarks) {
  const items = remarks.map(({ text, note }) => h("li", {}, text, note ? h("span", { class: "note" }, ` (${note})`) : null));
  return items.length ? [h("div", { class: `remark ${cssClass}` }, h("strong", {}, title), h("ul", {}, ...items))] : [];
}
