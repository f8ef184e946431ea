// @ts-check
/** Ranges of numbers of real-world evaluations, and the letters that stand for experiments. */

/**
 * Return the paper's ranges, as far as the longest of the experiments goes.
 *
 * @param {number} last
 * @returns {Page.Range[]}
 */
export function paperRanges(last) {
  /** @type {Page.Range[]} */
  const ranges = [[1, 1], [3, last], [6, last], ...(last > 1 ? [/** @type {Page.Range} */ ([1, last])] : [])];
  return ranges.filter(([from]) => from <= last);
}

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
