/** What a test says of a pair, in a sign and in words. */

const LEVEL = 0.05;

/** A p-value as papers write it. */
export function probability(p) {
  if (p === null || p === undefined) return "undefined";
  return p < 0.001 ? "p < 0.001" : `p = ${p.toFixed(3)}`;
}

/** An effect size, with its sign. */
export const size = (d) => (d === null || d === undefined ? "–" : `${d > 0 ? "+" : d < 0 ? "−" : ""}${Math.abs(d).toFixed(2)}`);

/** Whether the first of the pair is better, worse, not shown to differ, or not to be told. */
export function verdict(pair, test) {
  const p = pair[test].p_holm;
  if (p === null) return { kind: "unknown", sign: "–", words: "too few values to tell" };
  if (p >= LEVEL) return { kind: "alike", sign: "≈", words: "n. s." };
  return pair.difference > 0 ? { kind: "better", sign: "▲", words: "higher" } : { kind: "worse", sign: "▼", words: "lower" };
}

/** The pair seen from the other side. */
export const turned = (pair) => ({
  ...pair, first: pair.second, second: pair.first, n_first: pair.n_second, n_second: pair.n_first,
  difference: pair.difference === null ? null : -pair.difference, effect_size: pair.effect_size === null ? null : -pair.effect_size,
});
