import assert from "node:assert/strict";
import { test } from "node:test";
import { draftOf, specOf, ticked } from "../../api/dashboard/views/new/draft.js";
import { specIn, studyOf } from "../../api/dashboard/views/new/paste.js";
import { nearestPlace } from "../../api/dashboard/views/new/fields.js";
import { curlLines, pythonLines } from "../../api/dashboard/views/new/panel.js";

const CATALOGUE = {
  strategies: [{ name: "one" }, { name: "two" }, { name: "own" }],
  tunables: [{ name: "grip" }, { name: "mass" }],
  defaults: {
    strategies: [{ name: "two", options: {} }, { name: "one", options: {} }], robot: { name: "legs", options: {} },
    optimizer: { name: "climber", options: {} }, discrepancy: { name: "squares", options: {} }, tuner: { name: "hill", options: {} }, tunables: [{ name: "grip" }], budget: { preset: "paper", reuse_transfer: true },
  },
};

test("a spec goes through the form unchanged", () => {
  const spec = {
    name: "all", strategies: ["two", { name: "two", options: { weight: 0.5 } }], robot: { name: "wheels", options: { radius: 2 } }, engine: "fast",
    optimizer: "climber", discrepancy: { name: "squares", options: { to: 1 } }, tuner: "hill", tunables: ["grip", { name: "mass", lower: 0, upper: 2.5 }],
    reality: { engine: "slow", parameters: { grip: 0 } },
    budget: { preset: "smoke", controller_evaluations: 100, reuse_transfer: false },
    iterations: 3, repetitions: 4, direct_repetitions: 8, seed: 18446744073709551615n, priority: -10, max_parallel: 2,
  };
  assert.deepEqual(specOf(draftOf(spec, CATALOGUE)), spec);
});

test("what a spec leaves out is the catalogue's default, and counts are left to the service", () => {
  assert.deepEqual(specOf(draftOf({}, CATALOGUE)), {
    strategies: ["two", "one"], robot: "legs", optimizer: "climber", discrepancy: "squares", tuner: "hill", tunables: ["grip"], budget: "paper" });
});

test("strategies that are not chosen follow unticked, in the order of the catalogue", () => {
  const { strategies } = draftOf({ strategies: ["own"] }, CATALOGUE);
  assert.deepEqual(strategies.map(({ name, on }) => [name, on]), [["own", true], ["one", false], ["two", false]]);
  assert.deepEqual(ticked(strategies).map(({ name }) => name), ["own"]);
});

test("numbers are sent as numbers, and other text as it was typed", () => {
  const draft = draftOf({}, CATALOGUE);
  Object.assign(draft, { iterations: " 3 ", repetitions: "many", priority: "−2", seed: "18446744073709551615", max_parallel: "1e999", name: "  " });
  const { iterations, repetitions, priority, seed, max_parallel: most, name } = specOf(draft);
  assert.deepEqual([iterations, repetitions, priority, seed, most, name], [3, "many", -2, 18446744073709551615n, "1e999", undefined]);
});

test("no strategy is an empty list, which the service can refuse", () => {
  const draft = draftOf({ strategies: [] }, CATALOGUE);
  draft.tunables.forEach((tunable) => { tunable.on = false; });
  assert.deepEqual([specOf(draft).strategies, specOf(draft).tunables], [[], []]);
});

test("an error stands at the longest place that contains it", () => {
  const places = ["/strategies", "/strategies/1", null, "/strategies/1/options/weight", "/strategies/10"];
  assert.equal(nearestPlace("/strategies/1/options/weight", places), 3);
  assert.equal(nearestPlace("/strategies/1/options/other", places), 1);
  assert.equal(nearestPlace("/strategies/2", places), 0);
  assert.equal(nearestPlace("/strategies/10", places), 4);
  assert.equal(nearestPlace("/seed", places), -1);
});

test("a name with quotes is safe in a shell and in a program", () => {
  assert.ok(curlLines("http:/x/", `{"name":"it's"}`).endsWith(`-d '{"name":"it'\\''s"}'`));
  assert.ok(pythonLines("http:/x/", '{"name": "a"}').includes(`json.loads(r'''{"name": "a"}''')`));
  assert.ok(pythonLines("http:/x/", `{"name": "'''"}`).includes(`json.loads("{\\"name\\": \\"'''\\"}")`));
});

test("a pasted experiment becomes a study of one strategy, and what is no spec is told", () => {
  assert.deepEqual(studyOf({ strategy: "random", seed: 1 }), { seed: 1, strategies: ["random"] });
  assert.deepEqual(studyOf({ strategies: ["random"] }), { strategies: ["random"] });
  assert.deepEqual(specIn('{"seed": 18446744073709551615}'), { seed: 18446744073709551615n });
  assert.throws(() => specIn("{"), /This is not JSON/);
  assert.throws(() => specIn("[1]"), /A spec is an object/);
});
