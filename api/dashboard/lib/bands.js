/** What may be drawn around a curve, and how one chooses. */

import { h } from "./dom.js";

/** As `/figures/curves` has it; automatic is the interval, or the SD of fewer than five repetitions. */
export const BANDS = { "": "automatic", interval: "95 % interval of the mean", sd: "one standard deviation" };

/** A choice among them. */
export const bandChoice = (attributes = {}) =>
  h("select", attributes, ...Object.entries(BANDS).map(([value, words]) => h("option", { value }, words)));
