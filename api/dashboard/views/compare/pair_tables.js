// @ts-check
/** What the service says of pairs: as a matrix, as tables, and as files. */

import { getFile } from "../../lib/api.js";
import { copyButton } from "../../lib/copy.js";
import { h } from "../../lib/dom.js";
import { downloadLink } from "../../lib/downloads.js";
import { threeDigits } from "../../lib/format.js";
import { loading } from "../../lib/placeholders.js";
import { framed, table } from "../../lib/table.js";
import { TESTS } from "./address.js";

const EVERY = "Every pair, at every range, by every test";
export const UNPAIRED = /** @type {const} */ (["student", "welch", "mann_whitney"]);
const PAIRED = /** @type {const} */ (["paired_t", "wilcoxon"]);
const AFTER_HOLM = "p after Holm (raw)";

const BETTER = { kind: "better", sign: "▲" };
const WORSE = { kind: "worse", sign: "▼" };
/** @type {Partial<Record<Api.Found, typeof BETTER>>} */
const LOOKS = { higher: BETTER, wider: BETTER, lower: WORSE, narrower: WORSE, "n. s.": { kind: "alike", sign: "≈" } };
const UNKNOWN = { kind: "unknown", sign: "–" };

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

/**
 * Return a range in words.
 *
 * @param {Page.Range} range
 */
export const rangeText = ([from, to]) => (from === to ? `${from}` : `${from}–${to}`);

/**
 * Return which pairs differ, in a sentence.
 *
 * @param {string[]} experiments whose places give their letters
 * @param {Api.Comparison[]} pairs
 * @param {Page.Comparison["test"]} test
 */
export function differing(experiments, pairs, test) {
  const found = pairs.map((pair) => ({ pair, ...(LOOKS[pair[test].found] ?? UNKNOWN) }));
  const tested = found.filter(({ kind }) => kind !== "unknown").length;
  const differ = found.filter(({ kind }) => kind === "better" || kind === "worse");
  const { where } = pairs[0];
  const by = test === "trusted" ? "" : `, by ${TESTS[test].label}`;
  if (!tested) return `No pair can be tested ${where}${by}: there are too few values that vary.`;
  if (!differ.length) return `No pair differs ${where}${by}. That does not show that any are equal.`;
  /** @type {Map<string, string[]>} */
  const ahead = new Map();
  for (const { pair, kind } of differ) {
    const [first, other] = [pair.first, pair.second].map((id) => letter(experiments.indexOf(id)));
    const [more, less] = kind === "better" ? [first, other] : [other, first];
    ahead.set(more, [...(ahead.get(more) ?? []), less]);
  }
  const told = [...ahead].sort(([one], [other]) => one.length - other.length || one.localeCompare(other)).map(([more, less]) => `${more} ${test === "brown_forsythe" ? "wider than" : "above"} ${less.join(", ")}`);
  return `${differ.length} of ${pairs.length} ${pairs.length === 1 ? "pair differs" : "pairs differ"} ${where}${by}: ${told.join("; ")}.`;
}

/**
 * Return which pairs differ over one range, and the matrix: each pair once, the row against the column. It is folded while none differs.
 *
 * @param {Page.CompareView} view
 * @param {string[]} ids
 * @param {Api.Comparison[]} pairs
 * @param {boolean} isOpen whether a matrix without differences is unfolded
 */
export function matrix({ cache, choice: { experiments, test } }, ids, pairs, isOpen) {
  const letterOf = (/** @type {string} */ id) => letter(experiments.indexOf(id));
  const names = cache.namesOf(experiments);
  const pairOf = (/** @type {string} */ first, /** @type {string} */ second) => pairs.find((pair) => pair.first === first && pair.second === second);
  const title = `The row against the column, ${pairs[0].where}`;
  const named = (/** @type {string} */ id) => [h("b", {}, letterOf(id)), ` ${names.get(id)}`];
  const head = h("tr", {}, h("td", {}), ...ids.slice(1).map((id) => h("th", { scope: "col" }, named(id))));
  const rows = ids.slice(0, -1).map((row, index) => h("tr", {}, h("th", { scope: "row" }, named(row)),
    ...ids.slice(1).map((column, place) => (place < index ? h("td", { class: "blank" }) : cell(pairOf(row, column), test)))));
  const made = h("table", { class: "matrix", "aria-labelledby": "matrix-title" }, h("thead", {}, head), h("tbody", {}, ...rows));
  const whole = [h("p", { class: "note", id: "matrix-title" }, title), framed(title, made)];
  const areAlike = pairs.every((pair) => !["better", "worse"].includes((LOOKS[pair[test].found] ?? UNKNOWN).kind));
  return [h("p", { class: "sentence" }, differing(experiments, pairs, test)),
    ...(areAlike ? [h("details", { open: isOpen, class: "pairs alike" }, h("summary", {}, "The numbers of each pair"), ...whole)] : whole)];
}

/** @param {Api.Comparison | undefined} pair @param {Page.Comparison["test"]} test */
function cell(pair, test) {
  if (!pair) return h("td");
  const { found } = pair[test];
  const { kind, sign } = LOOKS[found] ?? UNKNOWN;
  if (kind === "unknown") return h("td", { class: kind }, found);
  return h("td", { class: kind }, h("span", { class: "verdict" }, h("span", { "aria-hidden": "true" }, `${sign} `), found), numbers(pair, test));
}

/** @type {(pair: Api.Comparison, test: Page.Comparison["test"]) => Page.Child} */
function numbers(pair, test) {
  const { effect_size_text: effect, equivalence, shared_streams: isShared, streams } = pair;
  const within = equivalence?.verdict === "equivalent" && h("small", { class: "within", title: equivalence.words }, `≡ within ±${threeDigits(equivalence.margin)}`);
  return [h("small", {}, `p ${pair[test].text}`), h("small", {}, `d = ${effect}`), test === "trusted" && isShared && h("small", { title: streams }, "paired"), within];
}

/**
 * Return a table of the experiments: mean, interquartile mean and standard deviation.
 *
 * @param {Page.CompareView} view
 * @param {Api.Comparison[]} pairs
 * @param {boolean} open whether the table is unfolded
 */
export function summaries({ choice: { experiments }, cache }, pairs, open) {
  const names = cache.namesOf(experiments);
  const found = new Map(pairs.flatMap((pair) => [[pair.first, pair.summary_first], [pair.second, pair.summary_second]]));
  const counts = new Map(pairs.flatMap((pair) => [[pair.first, pair.evaluations_first], [pair.second, pair.evaluations_second]]));
  const isAtCost = pairs[0].cost !== null;
  const rows = experiments.flatMap((id, index) => {
    const one = found.get(id);
    return one ? [[`${letter(index)} ${names.get(id)}`, ...(isAtCost ? [String(counts.get(id) ?? "–")] : []), String(one.n), one.mean.text, one.interquartile_mean.text, threeDigits(one.sd)]] : [];
  });
  const head = ["Experiment", ...(isAtCost ? ["Evaluations"] : []), "n", "Mean [95 %]", "Interquartile mean [95 %]", "SD"];
  return h("details", { open, class: "pairs each" }, h("summary", {}, "Each experiment, with intervals"), table("Each experiment", head, rows));
}

/**
 * Return a table of the pairs: each range by the chosen test, and the numbers of the last range by all tests.
 *
 * @param {Page.CompareView} view
 * @param {Page.RangeResult[]} results
 * @param {boolean} open whether the table is unfolded
 */
export function pairsTable({ choice: { test, experiments }, cache }, results, open) {
  const label = labelOf(experiments, cache);
  const chosen = results[results.length - 1];
  const sorted = [...results].sort((one, other) => one.range[0] - other.range[0] || one.range[1] - other.range[1]);
  const isShared = chosen.pairs.some((pair) => pair.shared_streams);
  const hasMargin = chosen.pairs.some((pair) => pair.equivalence);
  const tests = /** @type {const} */ ([...UNPAIRED, ...(isShared ? PAIRED : []), "brown_forsythe"]);
  const isAtCost = chosen.pairs[0].cost !== null;
  const columns = ["Pair", ...sorted.map(({ range }) => (isAtCost ? "At equal cost" : `${range[0] === range[1] ? "At" : "Mean of"} ${rangeText(range)}`)),
    `Difference ${isAtCost ? chosen.pairs[0].where : `at ${rangeText(chosen.range)}`} [90 %]`, "d", "P(first > second) [95 %]", "n", ...(hasMargin ? ["Equivalence"] : []),
    ...tests.map((name) => `${TESTS[name].short}, ${AFTER_HOLM}`), "Random streams"];
  const rows = chosen.pairs.map((pair, index) => [
    label(pair), ...sorted.map(({ pairs }) => result(pairs[index][test])), pair.difference_text, pair.effect_size_text, pair.improvement.text,
    pair.sizes, ...(hasMargin ? [pair.equivalence?.words ?? "–"] : []), ...tests.map((name) => pair[name].text), pair.streams,
  ]);
  return h("details", { open, class: "pairs every" }, h("summary", {}, EVERY), table("Pairs", columns, rows));
}

/** @param {Pick<Api.Test, "found" | "text">} test */
function result({ found, text }) {
  const { kind, sign } = LOOKS[found] ?? UNKNOWN;
  return h("span", { class: kind }, `${sign} ${found}`, kind === "unknown" ? "" : `, p ${text}`);
}

/**
 * Return the table of the pairs while it is folded and not loaded.
 *
 * @param {() => void} unfolded
 */
export const foldedPairs = (unfolded) => h("details", { class: "pairs every", ontoggle: unfolded }, h("summary", {}, EVERY), loading());

/**
 * Return the paper's pooled tests over a range; nothing at a single number.
 *
 * @param {Page.CompareView} view
 * @param {Api.Comparison[]} pairs
 * @param {boolean} open whether the table is unfolded
 */
export function pooledTable({ choice: { experiments }, cache }, pairs, open) {
  const label = labelOf(experiments, cache);
  const rows = pairs.flatMap((pair) => {
    const { pooled } = pair;
    return pooled ? [[label(pair), pooled.sizes, pooled.difference_text, pooled.effect_size_text, ...UNPAIRED.map((name) => pooled[name].text)]] : [];
  });
  if (!rows.length) return null;
  const head = ["Pair", "n", "Difference", "d", ...UNPAIRED.map((name) => `${TESTS[name].short}, ${AFTER_HOLM}`)];
  return h("details", { open, class: "pairs pooled" }, h("summary", {}, "The paper’s tests, pooled over the range"),
    h("p", { class: "caution" }, `⚠ ${pairs[0].pooled?.caution}`), table("Pooled", head, rows));
}

/** @type {(experiments: string[], cache: Page.CompareView["cache"]) => (pair: Api.Comparison) => string} */
function labelOf(experiments, cache) {
  const names = cache.namesOf(experiments);
  const one = (/** @type {string} */ id) => `${letter(experiments.indexOf(id))} ${names.get(id)}`;
  return (pair) => `${one(pair.first)} − ${one(pair.second)}`;
}

/** @type {[label: string, format: string, name: string][]} */
const FORMATS = [["CSV", "csv", "gaplab-comparisons.csv"], ["LaTeX", "latex", "gaplab-comparisons.tex"]];

/**
 * Return buttons that copy the tests of all pairs over a range, and links that save them.
 *
 * @param {Page.Query} asked what the comparison was asked for
 */
export function files(asked) {
  const copies = FORMATS.map(([label, format]) =>
    copyButton(`Copy as ${label}`, async () => (await getFile("/comparisons", { ...asked, format })).text()));
  const links = FORMATS.map(([label, format, name]) => downloadLink(label, "/comparisons", { ...asked, format }, name));
  return h("p", { class: "files exports" }, ...copies.flatMap((button) => [button, " "]), "Save as ", ...links.flatMap((link) => [link, " "]));
}
