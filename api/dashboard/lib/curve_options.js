// @ts-check
/** The options of a figure of curves, as `/figures/curves` takes them. */

import { h } from "./dom.js";

/**
 * The permitted bands with their labels. The automatic one is the interval, or the SD of fewer than five repetitions.
 *
 * @type {Record<string, string>}
 */
export const BANDS = { "": "automatic", interval: "95 % interval of the mean", sd: "one standard deviation" };

/**
 * Return a list to choose a band from.
 *
 * @param {Page.Attributes} [attributes]
 */
export const bandSelect = (attributes = {}) =>
  h("select", attributes, ...Object.entries(BANDS).map(([value, label]) => h("option", { value }, label)));

/** Return the options of a figure of curves: each repetition behind the mean, and the band. `change` is the event of a choice. */
export function curveOptions() {
  const each = h("input", { type: "checkbox" });
  const band = bandSelect();
  const element = h("p", { class: "options" }, h("label", {}, each, " Each repetition"), h("label", {}, "Band ", band));
  return { element, query: () => ({ band: band.value, each: each.checked || null }) };
}
