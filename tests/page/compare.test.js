import assert from "node:assert/strict";
import { test } from "node:test";
import { FakeNode } from "./fakes.js";

const { differing, letter, matrix, pairsTable, rangeText } = await import("../../api/dashboard/views/compare/pair_tables.js");
const { experimentCache } = await import("../../api/dashboard/views/compare/cache.js");
const { rangesOf } = await import("../../api/dashboard/views/compare/significance.js");

const test_ = (found, text = "0.012 (raw 0.004)") => ({ found, text });
const ESTIMATE = { text: "0.75 [0.5, 1]" };
const PAIR = {
  first: "a", second: "b", where: "after 3 real-world evaluations", sizes: "3, 4", difference_text: "+0.5 [0.25, 0.75]", effect_size_text: "+1.25",
  improvement: ESTIMATE, shared_streams: false, streams: "apart", equivalence: null, pooled: null, trusted: test_("higher"), student: test_("higher"),
  welch: test_("n. s."), mann_whitney: test_("too few values that vary", "–"), paired_t: test_("not paired", "–"), wilcoxon: test_("not paired", "–"),
  brown_forsythe: test_("narrower"),
};
const viewOf = (test) => ({ choice: { test, experiments: ["a", "b"] }, cache: { namesOf: (ids) => new Map(ids.map((id) => [id, id])) } });

/** Return kind and text of the cells of a matrix. */
function cells(test) {
  const place = new FakeNode("div");
  place.append(...matrix(viewOf(test), ["a", "b"], [PAIR], false));
  return place.querySelectorAll("td").filter((cell) => cell.getAttribute("class")).map((cell) => [cell.getAttribute("class"), cell.textContent]);
}

test("letters go on after Z", () => {
  assert.deepEqual([0, 25, 26, 51, 52, 701, 702].map(letter), ["A", "Z", "AA", "AZ", "BA", "ZZ", "AAA"]);
});

test("a comparison begins at the last shared number, where the paper's ranges end", () => {
  assert.deepEqual(rangesOf(10), [[10, 10], [1, 1], [3, 10], [6, 10], [1, 10]]);
  assert.deepEqual(rangesOf(5), [[5, 5], [1, 1], [3, 5], [1, 5]]);
  assert.deepEqual(rangesOf(1), [[1, 1]]);
  assert.deepEqual(rangesOf(0), [[0, 0]]);
  assert.deepEqual([rangeText([3, 3]), rangeText([3, 10])], ["3", "3–10"]);
});

test("the matrix prints what the service found, each pair once", () => {
  assert.deepEqual(cells("trusted"), [["better", "▲ higherp 0.012 (raw 0.004)d = +1.25"]]);
  assert.deepEqual(cells("brown_forsythe").map(([kind]) => kind), ["worse"]);
  assert.deepEqual(cells("welch").map(([kind]) => kind), ["alike"]);
  assert.deepEqual(cells("paired_t"), [["unknown", "not paired"]]);
});

test("a sentence says which pairs differ, or that none does", () => {
  const pair = (first, second, found) => ({ ...PAIR, first, second, trusted: test_(found) });
  const told = (...pairs) => differing(["a", "b", "c"], pairs, "trusted");
  assert.equal(told(pair("a", "b", "lower"), pair("a", "c", "higher"), pair("b", "c", "higher")), "3 of 3 pairs differ after 3 real-world evaluations: A above C; B above A, C.");
  assert.equal(told(pair("a", "b", "n. s."), pair("a", "c", "too few values that vary")), "No pair differs after 3 real-world evaluations. That does not show that any are equal.");
  assert.equal(told(pair("a", "b", "too few values that vary")), "No pair can be tested after 3 real-world evaluations: there are too few values that vary.");
  assert.equal(differing(["a", "b"], [PAIR], "brown_forsythe"), "1 of 1 pair differs after 3 real-world evaluations, by Brown–Forsythe, of the spread: B wider than A.");
});

test("experiments of one name are told apart by their studies, and by their ids within one", () => {
  const cache = experimentCache(new AbortController().signal);
  const experiment = (id, study) => ({ id, study, name: "some_fit", strategy: "some_fit" });
  cache.addStudy({ id: "s", name: "on wood", experiments: [experiment("a", "s")] });
  cache.addStudy({ id: "t", name: "on ice", experiments: [experiment("b", "t"), experiment("c", "t")] });
  assert.deepEqual([...cache.namesOf(["a", "b"]).values()], ["Some fit · on wood", "Some fit · on ice"]);
  assert.deepEqual([...cache.namesOf(["a", "b", "c"]).values()], ["Some fit · on wood", "Some fit · on ice (b)", "Some fit · on ice (c)"]);
  assert.deepEqual([...cache.namesOf(["b", "c"]).values()], ["Some fit (b)", "Some fit (c)"]);
  assert.deepEqual([...cache.namesOf(["a"]).values()], ["Some fit"]);
});

test("the table of pairs prints the texts of the service", () => {
  const text = pairsTable(viewOf("student"), [{ range: [3, 3], pairs: [PAIR] }], true).textContent;
  for (const words of ["A a − B b", "▲ higher, p 0.012 (raw 0.004)", "+0.5 [0.25, 0.75]", "0.75 [0.5, 1]", "3, 4", "apart"]) assert.ok(text.includes(words), words);
});
