import assert from "node:assert/strict";
import { test } from "node:test";
import { commonCount, isPooled, letter, rangesOf, rangeText } from "../../api/dashboard/views/compare/ranges.js";
import { differentSettings, warnings } from "../../api/dashboard/views/compare/remarks.js";
import { probability, signed, swapped, verdict } from "../../api/dashboard/views/compare/verdict.js";

const PAIR = {
  first: "a", second: "b", n_first: 3, n_second: 4, difference: 0.5, effect_size: -1.25,
  student: { p_holm: 0.01 }, welch: { p_holm: 0.05 }, mann_whitney: { p_holm: null },
};

/** Experiments that differ in their specs alone, with their letters. */
const lettered = (...experiments) => experiments.map((experiment, index) => [
  letter(index), { id: String(index), study: null, direct: false, level: false, ...experiment, spec: { robot: { name: "legs" }, reality: { parameters: { grip: 1 } }, ...experiment.spec } }]);

test("letters go on after Z", () => {
  assert.deepEqual([0, 25, 26, 51, 52, 701, 702].map(letter), ["A", "Z", "AA", "AZ", "BA", "ZZ", "AAA"]);
});

test("a comparison begins at the last shared number, and the paper's pooled ranges end where the experiments do", () => {
  assert.deepEqual(rangesOf(10, 10), [[10, 10], [1, 1], [3, 10], [6, 10], [1, 10]]);
  assert.deepEqual(rangesOf(3, 5), [[3, 3], [1, 1], [3, 5], [1, 5]]);
  assert.deepEqual(rangesOf(1, 1), [[1, 1]]);
  assert.deepEqual(rangesOf(0, 1), [[0, 0], [1, 1]]);
  assert.deepEqual([rangeText([3, 3]), rangeText([3, 10])], ["3", "3–10"]);
  assert.deepEqual([isPooled([3, 3]), isPooled([3, 10])], [false, true]);
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
});

test("a pair that is swapped twice is itself", () => {
  assert.deepEqual(swapped(swapped(PAIR)), PAIR);
  assert.deepEqual(swapped({ ...PAIR, difference: null }).difference, null);
});

test("p-values and effect sizes are written as in papers", () => {
  assert.deepEqual([null, 0.0009, 0.001, 0.25].map(probability), ["undefined", "p < 0.001", "p = 0.001", "p = 0.250"]);
  assert.deepEqual([null, 0, 1.234, -0.5].map(signed), ["–", "0.00", "+1.23", "−0.50"]);
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
