import assert from "node:assert/strict";
import { test } from "node:test";
import { commonCount, isSeveral, letter, rangesOf, rangeText } from "../../api/dashboard/views/compare/ranges.js";
import { differentSettings, warnings } from "../../api/dashboard/views/compare/remarks.js";
import { bothProbabilities, estimated, interval, probability, signed, swapped, verdict } from "../../api/dashboard/views/compare/verdict.js";

const PAIR = {
  first: "a", second: "b", n_first: 3, n_second: 4, difference: 0.5, effect_size: -1.25,
  lower: 0.25, upper: 0.75, improvement: { value: 0.75, lower: 0.5, upper: null }, shared_streams: false,
  summary_first: { sd: 1 }, summary_second: { sd: 2 },
  trusted: { p_holm: 0.01 }, student: { p_holm: 0.01 }, welch: { p_holm: 0.05 }, mann_whitney: { p_holm: null },
  paired_t: { p_holm: null }, brown_forsythe: { p_holm: 0.01 },
};

/** Experiments that differ in their specs alone, with their letters. */
const lettered = (...experiments) => experiments.map((experiment, index) => [
  letter(index), { id: String(index), study: null, direct: false, level: false, ...experiment, spec: { robot: { name: "legs" }, reality: { parameters: { grip: 1 } }, ...experiment.spec } }]);

test("letters go on after Z", () => {
  assert.deepEqual([0, 25, 26, 51, 52, 701, 702].map(letter), ["A", "Z", "AA", "AZ", "BA", "ZZ", "AAA"]);
});

test("a comparison begins at the last shared number, where the paper's ranges end", () => {
  assert.deepEqual(rangesOf(10), [[10, 10], [1, 1], [3, 10], [6, 10], [1, 10]]);
  assert.deepEqual(rangesOf(5), [[5, 5], [1, 1], [3, 5], [1, 5]]);
  assert.deepEqual(rangesOf(1), [[1, 1]]);
  assert.deepEqual(rangesOf(0), [[0, 0]]);
  assert.deepEqual([rangeText([3, 3]), rangeText([3, 10])], ["3", "3–10"]);
  assert.deepEqual([isSeveral([3, 3]), isSeveral([3, 10])], [false, true]);
});

test("the last shared number is that of experiments which go on or have completed, without levels", () => {
  const at = (evaluations, state = "COMPLETED", level = false) => ({ state, level, fitness: evaluations === null ? null : { evaluations } });
  assert.equal(commonCount([at(5), at(3), at(0, "COMPLETED", true), at(null)]), 3);
  assert.equal(commonCount([at(5), at(1, "CANCELLED"), at(2, "FAILED")]), 5);
  assert.equal(commonCount([at(1, "CANCELLED"), at(2, "FAILED")]), 1);
  assert.equal(commonCount([]), 0);
});

test("a pair differs below 0.05, and its sign says which is higher", () => {
  assert.equal(verdict(PAIR, "student").kind, "better");
  assert.equal(verdict(swapped(PAIR), "student").kind, "worse");
  assert.equal(verdict(PAIR, "welch").kind, "alike");
  assert.equal(verdict(PAIR, "mann_whitney").kind, "unknown");
  assert.equal(verdict(PAIR, "trusted").words, "higher");
});

test("paired tests are of pairs that share random streams, and spreads are wider or narrower", () => {
  assert.equal(verdict(PAIR, "paired_t").words, "not paired");
  assert.equal(verdict({ ...PAIR, shared_streams: true }, "paired_t").words, "too few values to tell");
  assert.deepEqual([verdict(PAIR, "brown_forsythe").words, verdict(swapped(PAIR), "brown_forsythe").words], ["narrower", "wider"]);
});

test("a pair that is swapped twice is itself", () => {
  assert.deepEqual(swapped(swapped(PAIR)), PAIR);
  assert.deepEqual(swapped({ ...PAIR, difference: null }).difference, null);
});

test("numbers have their intervals, and p-values both", () => {
  assert.deepEqual([estimated(PAIR.improvement), estimated({ value: 0.5, lower: 0.25, upper: 1 })], ["0.75", "0.5 [0.25, 1]"]);
  assert.equal(estimated({ value: null, lower: null, upper: null }), "–");
  assert.deepEqual([bothProbabilities({ p: 0.01, p_holm: 0.03 }), bothProbabilities({ p: 0.0001, p_holm: 0.0003 })],
    ["p = 0.030, raw 0.010", "p < 0.001, raw < 0.001"]);
  assert.equal(bothProbabilities({ p: null, p_holm: null }), "undefined");
});

test("p-values and effect sizes are written as in papers", () => {
  assert.deepEqual([null, 0.0009, 0.001, 0.25].map(probability), ["undefined", "p < 0.001", "p = 0.001", "p = 0.250"]);
  assert.deepEqual([null, 0, 1.234, -0.5].map(signed), ["–", "0", "+1.23", "−0.5"]);
});

test("a difference that is small and significant is not written as 0", () => {
  assert.equal(`${signed(0.0012345)}${interval(0.0004, 0.00207)}`, "+0.00123 [0.0004, 0.00207]");
  assert.equal(`${signed(-0.0012345)}${interval(-0.00207, -0.0004)}`, "−0.00123 [−0.00207, −0.0004]");
  assert.equal(estimated({ value: 0.00123, lower: 0.00119, upper: 0.00127 }), "0.00123 [0.00119, 0.00127]");
});

test("robots and realities of one name are told apart by the options in which they differ", () => {
  const specs = [[5, "newton"], [10, "cg"]].map(([seconds, solver]) => ({ spec: {
    robot: { name: "quadruped", options: { counted_s: seconds, legs: 4 } },
    reality: { engine: { name: "mujoco", options: { solver } }, parameters: { restitution: 0 } },
  } }));
  const [robots, realities] = warnings(lettered(...specs));
  assert.match(robots, /A: quadruped \(counted s 5\); B: quadruped \(counted s 10\)\./);
  assert.match(realities, /A: mujoco \(solver "newton"\), restitution 0; B: mujoco \(solver "cg"\), restitution 0\./);
});

test("equal realities need no warning, whatever the order of their keys", () => {
  const [one, other] = [{ grip: 1, mass: 2 }, { mass: 2, grip: 1 }].map((parameters) => ({ spec: { reality: { parameters } } }));
  assert.deepEqual(warnings(lettered(one, other)), []);
});

test("a hidden reality is the same within a study, and unknown beyond it", () => {
  const hidden = (study) => ({ study, spec: { reality: { parameters: { grip: null } } } });
  assert.deepEqual(warnings(lettered(hidden("s"), hidden("s"), { study: "s" })), []);
  assert.match(warnings(lettered(hidden("s"), hidden("t")))[0], /hidden until their experiments have ended/);
});

test("other settings are named, except those of the direct baseline", () => {
  const small = { spec: { iterations: 3 } };
  assert.deepEqual(differentSettings(lettered(small, { spec: { iterations: 10 } })), ["number of iterations"]);
  assert.deepEqual(differentSettings(lettered(small, { direct: true, level: true, spec: { iterations: 10 } })), []);
  assert.deepEqual(differentSettings(lettered(small, { level: true, spec: { iterations: 10 } })), []);
});

test("realities are the same whatever is measured of them, and a bench has its name", () => {
  const legs = (probes) => ({ spec: { reality: { kind: "simulated", engine: { name: "legs" }, parameters: { grip: 1 }, bench: null, repeats: 1, probes } } });
  assert.deepEqual(warnings(lettered(legs("each"), legs("last"))), []);
  assert.deepEqual(differentSettings(lettered(legs("each"), legs("last"))), ["probes"]);
  const bench = (name, repeats) => ({ spec: { reality: { kind: "physical", engine: null, parameters: {}, bench: name, repeats, probes: "last" } } });
  assert.deepEqual(warnings(lettered(bench("leg", 1), bench("leg", 3))), []);
  assert.deepEqual(differentSettings(lettered(bench("leg", 1), bench("leg", 3))), ["repeats of a measurement"]);
  assert.match(warnings(lettered(legs("each"), bench("leg", 1)))[0], /A: legs, grip 1; B: the robot on the bench “leg”\./);
});
