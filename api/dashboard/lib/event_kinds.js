// @ts-check
/** Kinds of events, by what they change. */

/** The kinds that take steps out of a log. @type {Api.EventKind[]} */
export const REWRITES = ["corrected", "voided", "decided"];

/** The kinds that may change every figure. @type {Api.EventKind[]} */
export const FIGURE_KINDS = ["completed", "failed", "cancelled", "extended", "imported", ...REWRITES];

/** The kinds that may change a curve. @type {Api.EventKind[]} */
export const CURVE_KINDS = ["transferred", "probed", "repetition_completed", ...FIGURE_KINDS];
