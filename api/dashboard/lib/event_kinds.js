// @ts-check
/** Kinds of events, by what they change. */

/** The kinds of events that take steps out of a log. */
export const REWRITES = ["corrected", "voided", "decided"];

/** The kinds of events that may change every figure. */
export const FIGURE_KINDS = ["completed", "failed", "cancelled", "extended", "imported", ...REWRITES];

/** The kinds of events that may change a curve. */
export const CURVE_KINDS = ["transferred", "probed", "repetition_completed", ...FIGURE_KINDS];
