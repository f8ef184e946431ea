import "./fakes.js";
import assert from "node:assert/strict";
import { test } from "node:test";
import { addTunable, draftOf, followRobot, plainName, specOf, ticked } from "../../api/dashboard/views/new/draft.js";
import { specIn, studyOf } from "../../api/dashboard/views/new.js";
import { nearestPlace } from "../../api/dashboard/views/new/fields.js";
import { exampleOf, hintOf, keptText } from "../../api/dashboard/views/new/reality_part.js";
import { curlLines, pythonLines } from "../../api/dashboard/views/new/panel.js";

const CATALOGUE = {
  strategies: [{ name: "one" }, { name: "two" }, { name: "own" }],
  tunables: [{ name: "grip" }, { name: "mass" }],
  robots: [{ name: "legs", details: {} }, { name: "wheels", details: { tunables: ["mass(axle)", "grip"] } }],
  defaults: {
    strategies: [{ name: "two", options: {} }, { name: "one", options: {} }], robot: { name: "legs", options: {} },
    optimizer: { name: "climber", options: {} }, discrepancy: { name: "squares", options: {} }, tuner: { name: "hill", options: {} }, tunables: [{ name: "grip" }], budget: { preset: "paper", reuse_transfer: false },
  },
};

test("a spec goes through the form unchanged", () => {
  const spec = {
    name: "all", strategies: ["two", { name: "two", options: { weight: 0.5 } }], robot: { name: "wheels", options: { radius: 2 } }, engine: "fast",
    optimizer: "climber", controller_optimizer: { name: "climber", options: { steps: 2 } }, discrepancy: { name: "squares", options: { to: 1 } }, tuner: "hill", tunables: ["grip", { name: "mass", lower: 0, upper: 2.5 }],
    reality: { engine: "slow", parameters: { grip: 0 } },
    budget: { preset: "smoke", controller_evaluations: 100, reuse_transfer: true },
    iterations: 3, repetitions: 4, direct_repetitions: 8, seed: 18446744073709551615n, priority: -10, max_parallel: 2,
  };
  assert.deepEqual(specOf(draftOf(spec, CATALOGUE)), spec);
});

test("a robot's usual tunables are ticked when it is chosen, unless others are", () => {
  const names = () => ticked(draft.tunables).map(({ name }) => name);
  const draft = draftOf({}, CATALOGUE);
  assert.deepEqual(names(), ["grip"]);

  draft.robot.name = "wheels";
  followRobot(draft, CATALOGUE);
  assert.deepEqual(names(), ["mass(axle)", "grip"]);
  assert.deepEqual(ticked(draftOf({ robot: "wheels" }, CATALOGUE).tunables), ticked(draft.tunables));

  draft.tunables[0].upper = "2";
  draft.robot.name = "legs";
  followRobot(draft, CATALOGUE);
  assert.deepEqual(names(), ["mass(axle)", "grip"]);
});

test("a tunable of a part goes through the form by its label, and is added once", () => {
  const spec = { strategies: ["one"], tunables: [{ name: "mass(trunk)", lower: 0.5, upper: 2 }, "grip"], reality: { parameters: { "mass(trunk)": 1.2 } } };
  const draft = draftOf(spec, CATALOGUE);
  assert.deepEqual(specOf(draft).tunables, spec.tunables);
  assert.deepEqual(specOf(draft).reality, spec.reality);
  addTunable(draft, " mass(*_shin, as=value) ");
  addTunable(draft, "mass(*_shin, as=value)");
  addTunable(draft, "mass");
  addTunable(draft, "");
  assert.deepEqual(ticked(draft.tunables).map(({ name }) => name), ["mass(trunk)", "grip", "mass", "mass(*_shin, as=value)"]);
  assert.deepEqual(["mass", "mass(trunk)", "kp (*, as=value)"].map(plainName), ["mass", "mass", "kp"]);
});

test("a physical reality goes through the form unchanged, and one that becomes simulated leaves out what only a bench has", () => {
  const reality = {
    kind: "physical", bench: "leg 1", probes: "never", beyond: "refuse", repeats: 3,
    samples: [{ genome: [0.5], values: [0.4, 0.5] }], limits: { joint_speed: 12.5 },
  };
  const draft = draftOf({ reality }, CATALOGUE);
  assert.deepEqual(specOf(draft).reality, reality);
  draft.bench.isPhysical = false;
  assert.deepEqual(specOf(draft).reality, { probes: "never" });
  draft.bench.isPhysical = true;
  Object.assign(draft.bench, { bench: "  ", repeats: "three", probes: "", samples: [], beyond: "" });
  draft.bench.limits.joint_speed = "";
  assert.deepEqual(specOf(draft).reality, { kind: "physical", repeats: "three" });
});

test("a recorded reality goes through the form unchanged, and compares readings", () => {
  const reality = { kind: "recorded", pool: "tosses", held_out: 0.3 };
  const spec = specOf(draftOf({ reality: { ...reality, pool: { name: "tosses", sha256: "5f" } }, discrepancy: "squared_fitness" }, CATALOGUE));
  assert.deepEqual([spec.reality, spec.discrepancy], [reality, undefined]);
});

test("a resolved reality without a bench is simulated", () => {
  const resolved = { kind: "simulated", engine: { name: "slow", options: {} }, parameters: {}, bench: null, repeats: 1, samples: [], probes: "each", limits: null, beyond: "warn" };
  assert.deepEqual(specOf(draftOf({ reality: resolved }, CATALOGUE)).reality, { engine: "slow", probes: "each" });
});

test("the noise of a simulated reality goes through the form unchanged, and a bench has none", () => {
  const draft = draftOf({ reality: { noise: 0.1 } }, CATALOGUE);
  assert.deepEqual(specOf(draft).reality, { noise: 0.1 });
  draft.bench.isPhysical = true;
  assert.deepEqual(specOf(draft).reality, { kind: "physical" });
});

test("a preset goes through the form, with the options that change it", () => {
  const strategies = [{ name: "one", preset: "smith_2019", options: { gain: 2 } }, { name: "one", preset: "smith_2019" }];
  assert.deepEqual(specOf(draftOf({ strategies }, CATALOGUE)).strategies, strategies);
});

test("a table of samples is described by its columns, and what is used of it in words", () => {
  assert.match(hintOf(1), /^Columns gene_0, then value,/);
  assert.match(hintOf(24), /^Columns gene_0 to gene_23, then value,/);
  assert.equal(exampleOf(1), "gene_0,value_1,value_2\n");
  assert.equal(exampleOf(24), "gene_0,gene_1,gene_2,…,value_1,value_2\n");
  const of = (...repeats) => keptText(repeats.map((length) => ({ values: Array(length).fill(0) })));
  assert.deepEqual([of(1), of(3, 3), of(1, 3)], ["1 sample of 1 value each.", "2 samples of 3 values each.", "2 samples of 1 to 3 values each."]);
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

test("a pasted experiment becomes a study of one strategy, and what is not a spec is told", () => {
  assert.deepEqual(studyOf({ strategy: "random", seed: 1 }), { seed: 1, strategies: ["random"] });
  assert.deepEqual(studyOf({ strategies: ["random"] }), { strategies: ["random"] });
  assert.deepEqual(specIn('{"seed": 18446744073709551615}'), { seed: 18446744073709551615n });
  assert.throws(() => specIn("{"), /This is not JSON/);
  assert.throws(() => specIn("[1]"), /A spec is an object/);
});
