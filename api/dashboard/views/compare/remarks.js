// @ts-check
/** What a reader must know before believing a comparison: different robots, different realities, other settings. */

import { h, refill } from "../../lib/dom.js";
import { letter } from "./ranges.js";

/** @type {Record<string, string>} */
const SETTINGS = { engine: "engine", tunables: "tunables", budget: "budget", optimizer: "optimizer", controller_optimizer: "optimizer of controllers", discrepancy: "discrepancy", tuner: "tuner", iterations: "number of iterations" };

/** How reality is measured, which does not make it another one. @type {[key: string, words: string][]} */
const MEASURING = [["probes", "probes"], ["repeats", "repeats of a measurement"], ["samples", "samples from before"]];

/** @typedef {{ id: string, study: string | null, direct: boolean, level: boolean, spec: Record<string, any> }} Experiment */
/** @typedef {[letter: string, experiment: Experiment]} Lettered */
/** @typedef {{ name: string, options?: Record<string, unknown> }} Plugin */

/**
 * Return the remarks on the chosen experiments.
 *
 * @param {Page.CompareView} view
 * @returns {Page.ComparePart}
 */
export function remarks(view) {
  const element = h("div", { class: "remarks", role: "status" });
  const update = () => {
    const lettered = view.choice.experiments.flatMap((id, index) => {
      const experiment = view.cache.get(id);
      return experiment ? [/** @type {Lettered} */ ([letter(index), experiment])] : [];
    });
    const texts = warnings(lettered);
    const settings = differentSettings(lettered);
    refill(element, JSON.stringify([texts, settings]), () => [
      texts.length ? h("div", { class: "remark warned" }, ...texts.map((text) => h("p", {}, text))) : null,
      settings.length ? h("p", { class: "note" }, `They also differ in: ${settings.join(", ")}.`) : null,
    ]);
  };
  return { element, update };
}

/**
 * Return a warning for each reason why experiments should not be compared.
 *
 * @param {Lettered[]} experiments
 */
export function warnings(experiments) {
  const robots = groups(experiments, ({ spec }) => canonicalText(spec.robot));
  const realities = groups(experiments, realityKeys(experiments));
  const texts = [];
  if (robots.length > 1) {
    const all = experiments.map(([, { spec }]) => spec.robot);
    const which = groupTexts(robots, ({ spec }) => pluginText(spec.robot, all));
    texts.push(`⚠ Different robots: ${which}. Their fitness does not mean the same, and differences between them say nothing.`);
  }
  if (realities.length > 1 && realities.some(({ key }) => key.startsWith("hidden"))) {
    texts.push("⚠ Some realities are hidden until their experiments have ended, so it is not known yet whether all realities are the same.");
  } else if (realities.length > 1) {
    const which = groupTexts(realities, (experiment) => realityText(experiment, experiments));
    texts.push(`⚠ Different realities: ${which}. A difference may come from the reality, not from the strategy.`);
  }
  return texts;
}

/**
 * Return the names of the other settings that are not the same; those of the direct baseline mean nothing, nor does
 * the number of iterations of an experiment without samples.
 *
 * @param {Lettered[]} experiments
 */
export function differentSettings(experiments) {
  const counts = (/** @type {string} */ setting, /** @type {Experiment} */ { direct, level }) => !direct && !(level && setting === "iterations");
  const differ = (/** @type {string} */ setting) => groups(experiments.filter(([, experiment]) => counts(setting, experiment)), ({ spec }) => canonicalText(spec[setting])).length > 1;
  const measuring = MEASURING.filter(([key]) => groups(experiments, ({ spec }) => canonicalText(spec.reality[key])).length > 1);
  return [...Object.keys(SETTINGS).filter(differ).map((setting) => SETTINGS[setting]), ...measuring.map(([, words]) => words)];
}

/**
 * Return the experiments that have the same key together.
 *
 * @param {Lettered[]} experiments
 * @param {(experiment: Experiment) => string} keyOf
 */
function groups(experiments, keyOf) {
  /** @type {Map<string, Lettered[]>} */
  const members = new Map();
  for (const lettered of experiments) {
    const key = keyOf(lettered[1]);
    members.set(key, [...(members.get(key) ?? []), lettered]);
  }
  return [...members].map(([key, group]) => ({ key, group }));
}

/**
 * Return a function that gives the same key for the same reality. A study has one reality, also while it is hidden in some experiments.
 *
 * @param {Lettered[]} experiments
 */
function realityKeys(experiments) {
  const shown = experiments.map(([, experiment]) => experiment).filter((experiment) => experiment.study && !isHidden(experiment));
  const byStudy = new Map(shown.map(({ study, spec }) => [study, realityKey(spec.reality)]));
  return (/** @type {Experiment} */ experiment) => {
    const { id, study, spec } = experiment;
    if (!isHidden(experiment)) return realityKey(spec.reality);
    return byStudy.get(study) ?? `hidden ${study ?? id} ${canonicalText(spec.reality.engine)}`;
  };
}

/** @param {Record<string, any>} reality */
const realityKey = ({ kind, engine, parameters, bench }) => canonicalText({ kind, engine, parameters, bench });

/** @param {Experiment} experiment */
const isHidden = ({ spec }) => Object.values(spec.reality.parameters).includes(null);

/**
 * @param {Experiment} experiment
 * @param {Lettered[]} experiments
 */
function realityText({ spec: { reality: { kind, engine, parameters, bench } } }, experiments) {
  if (kind === "physical") return `the robot on the bench “${bench}”`;
  const engines = experiments.map(([, { spec }]) => spec.reality.engine).filter(Boolean);
  return [engine && pluginText(engine, engines), ...Object.entries(parameters).map(optionText)].filter(Boolean).join(", ");
}

/**
 * Return a plug-in's name, with the options in which it differs from others of that name.
 *
 * @param {Plugin} plugin
 * @param {Plugin[]} all
 */
function pluginText({ name, options = {} }, all) {
  const others = all.filter((other) => other.name === name).map((other) => other.options ?? {});
  const differing = Object.entries(options).filter(([key, value]) => others.some((other) => canonicalText(other[key]) !== canonicalText(value)));
  return differing.length ? `${name} (${differing.map(optionText).join(", ")})` : name;
}

/** @type {(option: [string, unknown]) => string} */
const optionText = ([name, value]) => `${name.replaceAll("_", " ")} ${canonicalText(value)}`;

/**
 * @param {ReturnType<typeof groups>} all
 * @param {(experiment: Experiment) => string} textOf
 */
const groupTexts = (all, textOf) => all.map(({ group }) => `${group.map(([short]) => short).join(", ")}: ${textOf(group[0][1])}`).join("; ");

/**
 * Return the same text for equal values, whatever the order of their keys.
 *
 * @param {unknown} value
 * @returns {string}
 */
function canonicalText(value) {
  return JSON.stringify(value, (_, item) => (item && typeof item === "object" && !Array.isArray(item)
    ? Object.fromEntries(Object.entries(item).sort(([a], [b]) => (a < b ? -1 : 1))) : item)) ?? "";
}
