// @ts-check
/** Ranges of numbers of real-world evaluations, and the letters that stand for experiments. */

/**
 * Return the last number of real-world evaluations that experiments share; 0 without any result.
 *
 * An experiment without samples has a single value, which is compared with every number. Experiments that failed or were cancelled lower the
 * number only if no other has a result.
 *
 * @param {{ level: boolean, state: Api.State, fitness: Api.FitnessRead | null }[]} experiments
 */
export function commonCount(experiments) {
  const known = experiments.filter(({ fitness, level }) => fitness && !level);
  const lasting = known.filter(({ state }) => state !== "FAILED" && state !== "CANCELLED");
  const counts = (lasting.length ? lasting : known).map(({ fitness }) => fitness?.evaluations ?? 0);
  return counts.length ? Math.min(...counts) : 0;
}

/**
 * Return the ranges to compare over, the last shared number first: single numbers, and the paper's ranges up to the last shared number.
 *
 * @param {number} shared
 * @returns {Page.Range[]}
 */
export function rangesOf(shared) {
  /** @type {Page.Range[]} */
  const ranges = [[shared, shared], [1, 1], [3, shared], [6, shared], [1, shared]];
  const unique = new Map(ranges.map((range) => [rangeText(range), range]));
  return [...unique.values()].filter(([from, to]) => from <= to && to <= shared);
}

/** @param {Page.Range} range */
export const isSeveral = ([from, to]) => from !== to;

/**
 * Return a range in words.
 *
 * @param {Page.Range} range
 */
export const rangeText = ([from, to]) => (from === to ? `${from}` : `${from}–${to}`);

/**
 * Return the letters of an experiment by its place in the comparison: A to Z, then AA and so on.
 *
 * @param {number} index
 * @returns {string}
 */
export function letter(index) {
  const rest = Math.floor(index / 26);
  return (rest ? letter(rest - 1) : "") + String.fromCharCode(65 + (index % 26));
}
