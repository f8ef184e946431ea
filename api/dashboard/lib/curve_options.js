// @ts-check
/** The options of a figure of curves, as `/figures/curves` takes them. */

import { h, select } from "./dom.js";

/**
 * The permitted bands with their labels. The automatic one is the interval, or the SD of fewer than five repetitions.
 * @type {Record<string, string>}
 */
export const BANDS = { "": "automatic", interval: "95 % interval of the mean", sd: "one standard deviation" };

/** Return a list to choose a band from. @param {Page.Attributes} [attributes] */
export const bandSelect = (attributes = {}) => select(Object.entries(BANDS), attributes);

/** Whose fitness counts; by default the recorded one, with thin lines for transferred controllers alone. @type {Record<string, string>} */
export const FITNESS = {
  "": "recorded, and transferred alone", recorded: "recorded, as in the paper", transferred: "of transferred controllers alone",
  equal_chances: "best of the transferred ones: equal chances",
};

/** Return a list to choose the fitness from. @param {Page.Attributes} [attributes] */
export const fitnessSelect = (attributes = {}) => select(Object.entries(FITNESS), attributes);

/** Return the options of a figure of curves: whose fitness, each repetition behind the mean, and the band. `change` is the event of a choice. */
export function curveOptions() {
  const each = h("input", { type: "checkbox" });
  const [fitness, band] = [fitnessSelect(), bandSelect()];
  const element = h("p", { class: "options" }, h("label", {}, "Fitness ", fitness), h("label", {}, each, " Each repetition"), h("label", {}, "Band ", band));
  return { element, query: () => ({ fitness: fitness.value, band: band.value, each: each.checked || null }) };
}
