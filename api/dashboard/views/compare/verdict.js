// @ts-check
/** What a test says of a pair, in a sign and in words. */

const LEVEL = 0.05;

/** @typedef {Page.Comparison["test"]} TestName */

/**
 * Write a p-value as papers do.
 *
 * @param {number | null} p
 */
export function probability(p) {
  if (p === null) return "undefined";
  return p < 0.001 ? "p < 0.001" : `p = ${p.toFixed(3)}`;
}

/**
 * Write a difference or an effect size with its sign.
 *
 * @param {number | null} value
 */
export const signed = (value) => (value === null ? "–" : `${value > 0 ? "+" : value < 0 ? "−" : ""}${Math.abs(value).toFixed(2)}`);

/**
 * Return whether the first of a pair is higher, lower, not significantly different, or not known to be.
 *
 * @param {Api.Comparison} pair
 * @param {TestName} test
 */
export function verdict(pair, test) {
  const p = pair[test].p_holm;
  if (p === null) return { kind: "unknown", sign: "–", words: "too few values to tell" };
  if (p >= LEVEL) return { kind: "alike", sign: "≈", words: "n. s." };
  return (pair.difference ?? 0) > 0 ? { kind: "better", sign: "▲", words: "higher" } : { kind: "worse", sign: "▼", words: "lower" };
}

/**
 * Return a pair with its two sides exchanged.
 *
 * @param {Api.Comparison} pair
 * @returns {Api.Comparison}
 */
export const swapped = (pair) => ({
  ...pair, first: pair.second, second: pair.first, n_first: pair.n_second, n_second: pair.n_first,
  difference: negated(pair.difference), effect_size: negated(pair.effect_size),
});

/** @param {number | null} value */
const negated = (value) => (value === null ? null : -value);
