// @ts-check
/** What a test says of a pair, in a sign and in words. */

import { threeDigits } from "../../lib/format.js";

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
 * Write p after Holm's correction, and the raw p.
 *
 * @param {{ p: number | null, p_holm: number | null }} test
 */
export const bothProbabilities = (test) => probabilities(test).join(", ");

/**
 * Return p after Holm's correction and the raw p, each in words.
 *
 * @param {{ p: number | null, p_holm: number | null }} test
 */
export const probabilities = ({ p, p_holm: corrected }) =>
  (p === null ? ["undefined"] : [probability(corrected), `raw ${p < 0.001 ? "< 0.001" : p.toFixed(3)}`]);

/**
 * Write a difference or an effect size with its sign.
 *
 * @param {number | null} value
 */
export const signed = (value) => (value === null ? "–" : `${value > 0 ? "+" : value < 0 ? "−" : ""}${threeDigits(Math.abs(value))}`);

/**
 * Write a number with its interval.
 *
 * @param {Api.Estimate} estimate
 */
export const estimated = ({ value, lower, upper }) => `${threeDigits(value)}${interval(lower, upper)}`;

/**
 * Write an interval after its number; nothing if it is not known.
 *
 * @param {number | null} lower
 * @param {number | null} upper
 */
export const interval = (lower, upper) => (lower === null || upper === null ? "" : ` [${threeDigits(lower)}, ${threeDigits(upper)}]`);

/**
 * Return whether the first of a pair is higher, lower, not shown to differ, or not known to be; of spreads, wider or narrower.
 *
 * @param {Api.Comparison} pair
 * @param {TestName} test
 */
export function verdict(pair, test) {
  const p = pair[test].p_holm;
  const isPaired = test === "paired_t" || test === "wilcoxon";
  if (isPaired && !pair.shared_streams) return { kind: "unknown", sign: "–", words: "not paired" };
  if (p === null) return { kind: "unknown", sign: "–", words: "too few values to tell" };
  if (p >= LEVEL) return { kind: "alike", sign: "≈", words: "n. s." };
  if (test === "brown_forsythe") return wider(pair) ? { kind: "better", sign: "▲", words: "wider" } : { kind: "worse", sign: "▼", words: "narrower" };
  return (pair.difference ?? 0) > 0 ? { kind: "better", sign: "▲", words: "higher" } : { kind: "worse", sign: "▼", words: "lower" };
}

/** @param {Api.Comparison} pair */
const wider = ({ summary_first: first, summary_second: second }) => (first.sd ?? 0) > (second.sd ?? 0);

/**
 * Return a pair with its two sides exchanged.
 *
 * @param {Api.Comparison} pair
 * @returns {Api.Comparison}
 */
export const swapped = (pair) => ({
  ...pair, first: pair.second, second: pair.first, n_first: pair.n_second, n_second: pair.n_first,
  difference: negated(pair.difference), effect_size: negated(pair.effect_size),
  lower: negated(pair.upper), upper: negated(pair.lower), improvement: complement(pair.improvement),
  summary_first: pair.summary_second, summary_second: pair.summary_first,
});

/**
 * Return one minus a probability.
 *
 * @param {Api.Estimate} estimate
 */
const complement = ({ value, lower, upper }) => ({
  value: value === null ? null : 1 - value, lower: upper === null ? null : 1 - upper, upper: lower === null ? null : 1 - lower,
});

/** @param {number | null} value */
const negated = (value) => (value === null ? null : -value);
