// @ts-check
/** The part of the form about reality: simulated, or a robot on a bench. */

import { h } from "../../lib/dom.js";
import { readableName } from "../../lib/format.js";
import { LIMITS, plainName } from "./draft.js";
import { field, numberField } from "./fields.js";
import { part, pluginField } from "./form_parts.js";
import { samplesField } from "./samples_field.js";

/** @typedef {import("../new.js").Form} Form */

/** @type {import("./fields.js").Choices} */
const KINDS = [["simulated", "Simulated, with hidden parameters"], ["physical", "Physical: a robot on a bench"]];

/** @type {[probes: string, words: string][]} */
const PROBES = [["each", "after each iteration"], ["last", "after the last iteration"], ["never", "never: the curve has the best sample so far"]];

/** @type {Record<string, [label: string, hint: string]>} */
const LIMIT_WORDS = {
  joint_speed: ["Joint speed at most", "rad/s"], torque: ["Torque at most", "N·m"],
  tilt: ["Tilt of the base at most", "rad"], height: ["Height of the base at least", "m"],
};

/**
 * Return what reality is.
 *
 * @param {Form} form
 */
export function realityPart(form) {
  const { draft: { bench, strategies }, places, catalogue } = form;
  const set = (/** @type {string} */ kind) => {
    bench.isPhysical = kind === "physical";
    const baselines = catalogue.strategies.filter(({ details }) => details.baseline).map(({ name }) => name);
    const one = strategies.find(({ name, on }) => on && !baselines.includes(name));
    if (bench.isPhysical) for (const strategy of strategies) strategy.on = strategy === one;
    form.remake();
  };
  return part("Reality",
    field({ label: "Kind", value: bench.isPhysical ? "physical" : "simulated", set, pointer: "/reality/kind", places, choices: KINDS }),
    ...(bench.isPhysical ? physical(form) : simulated(form)));
}

/**
 * Return the engine and the hidden parameters of a simulated reality.
 *
 * @param {Form} form
 */
function simulated(form) {
  const { draft: { realityEngine, realityParameters, tunables }, places, catalogue } = form;
  const named = [...new Set([...tunables.map(({ name }) => name), ...Object.keys(realityParameters)])];
  const fields = named.flatMap((name) => {
    const plugin = catalogue.tunables.find((other) => other.name === plainName(name));
    return plugin?.available ? [numberField({
      label: readableName(name), value: realityParameters[name], set: form.setter(realityParameters, name), places, placeholder: "the robot’s own",
      pointer: `/reality/parameters/${name}`, hint: name.includes("=") ? "" : `${plugin.details.least} to ${plugin.details.greatest}` })] : [];
  });
  return [
    h("p", { class: "note" }, "Hidden from the strategies, and from everybody until the study has ended."),
    pluginField(form, "Engine of reality", realityEngine, catalogue.engines, "/reality/engine", "The engine of the simulators"),
    h("div", { class: "fields" }, ...fields), probesField(form, "each")];
}

/**
 * Return what is measured on a bench, what is known already, and the limits of the robot.
 *
 * @param {Form} form
 */
function physical(form) {
  const { draft: { bench, robot }, places } = form;
  const limits = LIMITS.map((name) => numberField({
    label: LIMIT_WORDS[name][0], hint: LIMIT_WORDS[name][1], value: bench.limits[name], set: form.setter(bench.limits, name),
    pointer: `/reality/limits/${name}`, places, placeholder: "not checked" }));
  const isOpen = Object.values(bench.limits).some((value) => value !== "") || bench.beyond !== "";
  return [
    h("p", { class: "note" }, "Measurements are requested on the page “Bench”, and repetitions wait for them, for a year if need be. Each strategy needs runs of its own, so one is ticked."),
    field({ label: "Name of the bench", hint: "one measurement is taken at a time on it", value: bench.bench, set: form.setter(bench, "bench"), pointer: "/reality/bench", places, maxlength: 200, placeholder: robot.name }),
    numberField({ label: "Repeats of each measurement", hint: "their mean is the fitness, their spread the noise", value: bench.repeats, set: form.setter(bench, "repeats"), pointer: "/reality/repeats", places, placeholder: "1" }),
    probesField(form, "last"),
    samplesField(form),
    h("details", { open: isOpen }, h("summary", {}, "Limits of the robot"),
      h("p", { class: "note" }, "Before a controller is offered, the simulators forecast whether it keeps them."),
      h("div", { class: "fields" }, ...limits),
      field({ label: "Beyond them", value: bench.beyond, set: form.setter(bench, "beyond"), pointer: "/reality/beyond", places,
        choices: [["", "offer it with a warning"], ["refuse", "refuse it: it counts as failed"]] }))];
}

/**
 * @param {Form} form
 * @param {string} usual
 */
function probesField(form, usual) {
  const { draft: { bench }, places } = form;
  /** @type {import("./fields.js").Choices} */
  const choices = [["", `${PROBES.find(([name]) => name === usual)?.[1]}, the default`], ...PROBES];
  return field({ label: "The transferred controller is measured", value: bench.probes, set: form.setter(bench, "probes"), pointer: "/reality/probes", places, choices });
}
