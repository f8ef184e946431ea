// @ts-check
/** The content of the form, and the spec that it makes: what the form leaves out, the service fills in. */

import { parseNumber } from "../../lib/json.js";

const COUNTS = ["iterations", "repetitions", "direct_repetitions", "seed", "priority", "max_parallel", "held_out"];
export const EVALUATIONS = ["controller_evaluations", "selection_evaluations", "simulator_evaluations"];

/** @typedef {Record<string, any>} Spec */

/** Return a plug-in as the form has it. @param {Page.PluginName} [given] @returns {Page.PluginDraft} */
function pluginDraft(given = "") {
  const { name, preset, options } = typeof given === "string" ? { name: given } : given;
  return { name, preset: preset ?? "", options: { ...options } };
}

/**
 * Return the form's content for a spec, with everything that the catalogue has to choose from.
 * @param {Spec} spec
 * @param {Api.Catalogue} catalogue
 * @returns {Page.Draft}
 */
export function draftOf(spec, catalogue) {
  const { defaults } = catalogue;
  const budget = typeof spec.budget === "string" ? { preset: spec.budget } : spec.budget ?? {};
  return {
    name: spec.name ?? "",
    ...Object.fromEntries(COUNTS.map((name) => [name, spec[name] ?? ""])),
    strategies: strategyDrafts(spec.strategies ?? defaults.strategies, catalogue),
    robot: pluginDraft(spec.robot ?? defaults.robot),
    controller: pluginDraft(spec.controller ?? ""),
    task: pluginDraft(spec.task ?? ""),
    engine: pluginDraft(spec.engine),
    optimizer: pluginDraft(spec.optimizer ?? defaults.optimizer),
    controllerOptimizer: pluginDraft(spec.controller_optimizer ?? ""),
    discrepancy: pluginDraft(spec.discrepancy ?? defaults.discrepancy),
    tuner: pluginDraft(spec.tuner ?? defaults.tuner),
    tunables: tunableDrafts(spec.tunables ?? usualTunables(pluginDraft(spec.robot ?? defaults.robot).name, catalogue), catalogue),
    tunablesOf: pluginDraft(spec.robot ?? defaults.robot).name,
    stop: { ...spec.stop },
    ...realityDraft(spec.reality ?? {}),
    budget: {
      preset: budget.preset ?? defaults.budget.preset,
      reuse_transfer: budget.reuse_transfer ?? defaults.budget.reuse_transfer,
      ...Object.fromEntries(EVALUATIONS.map((name) => [name, budget[name] ?? ""])),
    },
  };
}

export const LIMITS = ["joint_speed", "torque", "tilt", "height"];

/** @param {Spec} reality */
const realityDraft = ({ kind, pool, held_out: heldOut, engine, parameters, noise, noise_unit: noiseUnit, bench, repeats, probes, samples, limits, beyond }) => ({
  realityEngine: pluginDraft(engine ?? ""),
  realityParameters: { ...parameters },
  realityNoise: { noise: noise ?? "", noise_unit: noiseUnit ?? "" },
  bench: {
    isPhysical: kind === "physical", isRecorded: kind === "recorded", pool: pool?.name ?? pool ?? "", heldOut: heldOut ?? "", bench: bench ?? "", repeats: repeats ?? "", probes: probes ?? "", samples: samples ?? [],
    limits: Object.fromEntries(LIMITS.map((name) => [name, limits?.[name] ?? ""])), beyond: beyond === "refuse" ? beyond : "",
  },
});

/**
 * Return the named strategies, ticked and in their order, then the others of the catalogue.
 * @param {Page.PluginName[]} given a strategy may be there several times
 * @param {Api.Catalogue} catalogue
 * @returns {Page.PluginDraft[]}
 */
function strategyDrafts(given, catalogue) {
  const named = given.map((plugin) => ({ ...pluginDraft(plugin), on: true }));
  const others = catalogue.strategies.filter(({ name }) => !named.some((plugin) => plugin.name === name));
  return [...named, ...others.map(({ name }) => ({ ...pluginDraft(name), on: false }))];
}

/** @param {(string | { name: string, lower?: number, upper?: number })[]} given @param {Api.Catalogue} catalogue @returns {Page.TunableDraft[]} */
function tunableDrafts(given, catalogue) {
  const named = given.map((tunable) => (typeof tunable === "string" ? { name: tunable } : tunable));
  const others = catalogue.tunables.filter(({ name }) => !named.some((tunable) => tunable.name === name));
  return [  // their order changes the random numbers of a study
    ...named.map(({ name, lower = "", upper = "" }) => ({ name, on: true, lower, upper })),
    ...others.map(({ name }) => ({ name, on: false, lower: "", upper: "" })),
  ];
}

/**
 * Return what a spec tunes that names a robot and no tunables.
 * @param {string} robot
 * @param {Api.Catalogue} catalogue
 * @returns {(string | { name: string })[]}
 */
function usualTunables(robot, { robots, defaults }) {
  const usual = /** @type {string[] | undefined} */ (robots.find(({ name }) => name === robot)?.details.tunables);
  return usual?.length ? usual : defaults.tunables;
}

/**
 * Tick the usual tunables of a newly chosen robot, unless the reader has chosen others than those of the robot before.
 * @param {Page.Draft} draft
 * @param {Api.Catalogue} catalogue
 */
export function followRobot(draft, catalogue) {
  if (draft.tunablesOf === draft.robot.name) return;
  const usual = tunableDrafts(usualTunables(draft.tunablesOf, catalogue), catalogue);
  const isUsual = JSON.stringify(ticked(draft.tunables)) === JSON.stringify(ticked(usual));
  if (isUsual) draft.tunables = tunableDrafts(usualTunables(draft.robot.name, catalogue), catalogue);
  draft.tunablesOf = draft.robot.name;
}

/** Return the name of the plug-in that a label like `mass(trunk)` names. @param {string} label */
export const plainName = (label) => label.split("(")[0].trim();

/** Add a tunable by its label, ticked; one that is there is only ticked. @param {Page.Draft} draft @param {string} label */
export function addTunable({ tunables }, label) {
  const name = label.trim();
  const given = tunables.find((tunable) => tunable.name === name);
  if (given) given.on = true;
  else if (name) tunables.push({ name, on: true, lower: "", upper: "" });
}

/**
 * Return the strategies or tunables that are ticked, in their order in the spec.
 *
 * @template {{ on?: boolean }} Ticked
 * @param {Ticked[]} list
 */
export const ticked = (list) => list.filter(({ on }) => on);

/** Return the spec of a form. @param {Page.Draft} draft @returns {Spec} */
export function specOf(draft) {
  const { strategies, robot, controller, task, engine, optimizer, controllerOptimizer, discrepancy, tuner, tunables, budget } = draft;
  return withoutEmpty({
    name: draft.name.trim(),
    strategies: ticked(strategies).map(pluginName),
    robot: pluginName(robot),
    controller: controller.name ? pluginName(controller) : "",
    task: task.name ? pluginName(task) : "",
    engine: engine.name ? pluginName(engine) : "",
    optimizer: pluginName(optimizer),
    controller_optimizer: controllerOptimizer.name ? pluginName(controllerOptimizer) : "",
    discrepancy: draft.bench.isRecorded && discrepancy.name === "squared_fitness" ? "" : pluginName(discrepancy),
    tuner: pluginName(tuner),
    tunables: ticked(tunables).map(({ name, lower, upper }) => shortest({ name, ...withoutEmpty(typedValues({ lower, upper })) })),
    stop: withoutEmpty(typedValues(draft.stop)),
    reality: realityOf(draft),
    budget: budgetOf(budget),
    ...typedValues(Object.fromEntries(COUNTS.map((name) => [name, draft[name]]))),
  }, ["strategies", "tunables"]);
}

/** Return reality without what its kind does not have; the form keeps that while the reader changes the kind. @param {Page.Draft} draft */
function realityOf({ realityEngine, realityParameters, realityNoise, bench: { isPhysical, isRecorded, pool, heldOut, limits, samples, repeats, ...bench } }) {
  if (isRecorded) return withoutEmpty({ kind: "recorded", pool: pool.trim(), ...typedValues({ held_out: heldOut }) });
  if (!isPhysical) {
    const { probes } = bench;
    return withoutEmpty({ engine: realityEngine.name ? pluginName(realityEngine) : "", parameters: withoutEmpty(typedValues(realityParameters)), ...typedValues(realityNoise), probes });
  }
  const words = { ...bench, bench: bench.bench.trim() };
  return withoutEmpty({ kind: "physical", ...words, ...typedValues({ repeats }), samples, limits: withoutEmpty(typedValues(limits)) });
}

/** @param {Page.Draft["budget"]} budget */
function budgetOf({ preset, reuse_transfer: isReused, ...evaluations }) {
  const changes = withoutEmpty({ ...typedValues(evaluations), ...(isReused ? { reuse_transfer: true } : {}) });
  return Object.keys(changes).length ? { preset, ...changes } : preset;
}

/** Return a plug-in as a spec has it. @param {Page.PluginDraft} plugin */
export const pluginName = ({ name, preset, options }) => shortest({ name, ...withoutEmpty({ preset, options: withoutEmpty(typedValues(options)) }) });

/** @param {Spec} plugin a bare name stands for a plug-in that has nothing but its name */
const shortest = (plugin) => (Object.keys(plugin).length === 1 ? plugin.name : plugin);

/** @param {Spec} values */
const typedValues = (values) => Object.fromEntries(Object.entries(values).map(([name, value]) => [name, typedValue(value)]));

/** Return the number that was typed, or else the text, which the service then refuses with a reason. @param {unknown} value */
function typedValue(value) {
  if (typeof value !== "string") return value;
  const text = value.trim();
  return text && (parseNumber(text.replace("−", "-")) ?? text);
}

/** Return an object without empty values, except those whose names are kept. @param {Spec} values @param {string[]} [kept] @returns {Spec} */
function withoutEmpty(values, kept = []) {
  return Object.fromEntries(Object.entries(values).filter(([name, value]) => kept.includes(name) || !isEmpty(value)));
}

/** @param {unknown} value */
const isEmpty = (value) =>
  value === "" || value === null || value === undefined || (typeof value === "object" && !Object.keys(value).length);
