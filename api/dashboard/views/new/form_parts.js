// @ts-check
/** The parts of the form for a new study, made from the catalogue. */

import { h } from "../../lib/dom.js";
import { count, readableName } from "../../lib/format.js";
import { robotPicture } from "../../lib/robot_picture.js";
import { EVALUATIONS, addTunable, plainName, ticked } from "./draft.js";
import { errorRoom, field, numberField, optionFields, tickField } from "./fields.js";

/** @typedef {import("../new.js").Form} Form */

/** @param {string} title @param {...Page.Child} content */
export const part = (title, ...content) => h("fieldset", { class: "part" }, h("legend", {}, title), ...content);

/** Return the name, the sizes and the schedule of the study. @param {Form} form */
export function studyPart(form) {
  const { draft, places, catalogue } = form;
  const preset = catalogue.budgets.find(({ name }) => name === draft.budget.preset);
  /** @type {(name: string, label: string, hint: string, placeholder?: string) => HTMLElement} */
  const countField = (name, label, hint, placeholder = "") =>
    numberField({ label, hint, value: draft[name], set: form.setter(draft, name), pointer: `/${name}`, places, placeholder });
  return part("Study",
    field({ label: "Name", value: draft.name, set: form.setter(draft, "name"), pointer: "/name", places, maxlength: 200, placeholder: "study" }),
    h("div", { class: "fields" },
      countField("iterations", "Iterations", "real-world evaluations of a repetition", preset && count(preset.iterations)),
      countField("repetitions", "Repetitions", "of each strategy", preset && count(preset.repetitions)),
      countField("direct_repetitions", "Repetitions of the direct baseline", "", "as the strategies"),
      countField("seed", "Seed", "the same seed gives the same numbers", "0"),
      countField("priority", "Priority", "−10 to 10; the highest is computed first", "0"),
      countField("max_parallel", "Repetitions at once", "of an experiment", "any number"),
      countField("held_out", "Share of samples held out", "no tuning sees them, simulators are tested on them; 0.2: each fifth", "0")));
}

/** Return the strategies that are compared, each with its options; one can be there several times. @param {Form} form */
export function strategiesPart(form) {
  const { draft, places } = form;
  const room = errorRoom();
  const list = h("div", { class: "strategies" }, ...draft.strategies.map((strategy) => strategyField(form, strategy)));
  places.add(() => "/strategies", list, room);
  const tickAll = (/** @type {boolean} */ on) => () => {
    for (const strategy of draft.strategies) strategy.on = on;
    form.remake();
  };
  return part("Strategies", h("p", { class: "note" }, "One experiment each, all else equal. ",
    linkButton("All", tickAll(true)), " ", linkButton("None", tickAll(false))), room, list);
}

/** @param {string} label @param {() => void} press */
const linkButton = (label, press) => h("button", { type: "button", class: "link", onclick: press }, label);

/** @param {Form} form @param {Page.PluginDraft} strategy */
function strategyField(form, strategy) {
  const { catalogue, draft: { strategies }, places } = form;
  const plugin = catalogue.strategies.find(({ name }) => name === strategy.name);
  const room = errorRoom();
  const pointer = () => (strategy.on ? `/strategies/${ticked(strategies).indexOf(strategy)}` : null);
  const splice = (/** @type {Parameters<typeof strategies.splice>} */ ...change) => {
    strategies.splice(...change);
    form.remake();
  };
  const add = linkButton("Add again, with other options", () =>
    splice(strategies.indexOf(strategy) + 1, 0, { name: strategy.name, options: { ...strategy.options }, on: true }));
  const isRepeated = strategies.filter(({ name }) => name === strategy.name).length > 1;
  const remove = isRepeated ? linkButton("Remove", () => splice(strategies.indexOf(strategy), 1)) : null;
  const options = optionFields(plugin, strategy.options, pointer, form);
  const tick = (/** @type {boolean} */ on) => {
    strategy.on = on;
    form.remake();
  };
  const { box, element } = tickField([readableName(strategy.name), h("small", {}, plugin?.summary)], Boolean(strategy.on), tick);
  box.disabled = !strategy.on && plugin?.available === false;
  places.add(pointer, box, room);
  const open = Object.keys(strategy.options).length > 0;
  const more = options && strategy.on ? h("details", { open }, h("summary", {}, "Options"), options, h("p", {}, add, " ", remove)) : null;
  return h("div", { class: "strategy" }, element, whyUnavailable(plugin), room, more);
}

/** Return the robot, the engine of the simulators, the optimizer, and how simulators are tuned. @param {Form} form */
export function simulationPart(form) {
  const { draft, catalogue } = form;
  const robot = catalogue.robots.find(({ name }) => name === draft.robot.name);
  const isLean = catalogue.budgets.some(({ name, lean }) => lean && name === draft.budget.preset);
  const ownOf = (/** @type {any} */ { name }) => `The robot’s own: ${readableName(name)}`;
  const robotEngine = `The robot’s own${robot ? `: ${robot.details.engine}` : ""}`;
  return part("Simulation",
    pluginField(form, "Robot", draft.robot, catalogue.robots, "/robot"),
    robotPicture(robot, form.signal),
    ...(robot?.details.controller ? [
      pluginField(form, "Controller", draft.controller, catalogue.controllers ?? [], "/controller", ownOf(robot.details.controller)),
      pluginField(form, "Task", draft.task, catalogue.tasks ?? [], "/task", ownOf(robot.details.task))] : []),
    pluginField(form, "Engine of the simulators", draft.engine, catalogue.engines, "/engine", robotEngine),
    pluginField(form, "Optimizer", draft.optimizer, catalogue.optimizers, "/optimizer"),
    pluginField(form, "Optimizer of controllers", draft.controllerOptimizer, catalogue.optimizers, "/controller_optimizer", isLean ? "That of the lean budget" : "The same"),
    pluginField(form, "Tuner", draft.tuner, catalogue.tuners, "/tuner"),
    pluginField(form, "Tuning minimises", draft.discrepancy, catalogue.discrepancies, "/discrepancy"));
}

/**
 * Return a list of plug-ins to choose from, and the options of the chosen one. Unavailable plug-ins say why, and how to get them.
 * @param {Form} form
 * @param {string} label
 * @param {Page.PluginDraft} draft
 * @param {Api.PluginRead[]} plugins
 * @param {string} pointer
 * @param {string | null} [none] label of the choice of none
 */
export function pluginField(form, label, draft, plugins, pointer, none = null) {
  const chosen = plugins.find(({ name }) => name === draft.name);
  /** @type {Page.Choices} */
  const choices = plugins.map(({ name, available }) => [name, `${readableName(name)}${available ? "" : ": not available"}`, !available]);
  const set = (/** @type {string} */ name) => {
    Object.assign(draft, { name, options: {} });
    form.remake();
  };
  const options = optionFields(chosen, draft.options, () => pointer, form);
  return [
    field({ label, hint: chosen?.summary, value: draft.name, set, pointer, places: form.places, choices: none === null ? choices : [["", none], ...choices] }),
    ...plugins.map(whyUnavailable),
    options ? h("details", { open: Object.keys(draft.options).length > 0 }, h("summary", {}, `Options of ${readableName(draft.name)}`), options) : null];
}

/** Return why a plug-in is unavailable; null if it is not. @param {Api.PluginRead | undefined} plugin */
function whyUnavailable(plugin) {
  return plugin === undefined || plugin.available ? null
    : h("p", { class: "note" }, `${readableName(plugin.name)} is not available: `, h("code", {}, plugin.note));
}

/** Return what is tuned, and between which bounds. @param {Form} form */
export function tunablesPart(form) {
  const room = errorRoom();
  const list = h("div", {}, ...form.draft.tunables.map((tunable) => tunableField(form, tunable)));
  form.places.add(() => "/tunables", list, room);
  const label = h("input", { type: "text", placeholder: "mass(trunk)", maxlength: 100, "aria-label": "Tunable of a part of the robot" });
  const add = () => {
    addTunable(form.draft, label.value);
    form.remake();
  };
  return part("What is tuned", room, list,
    h("p", { class: "note" }, "Of a part of the robot, by pattern: ", label, " ", linkButton("Add", add)));
}

/** @param {Form} form @param {Page.TunableDraft} tunable */
function tunableField(form, tunable) {
  const { draft, places, catalogue } = form;
  const { name, on } = tunable;
  const plugin = catalogue.tunables.find((other) => other.name === plainName(name));
  const pointer = () => (tunable.on ? `/tunables/${ticked(draft.tunables).indexOf(tunable)}` : null);
  const tick = (/** @type {boolean} */ isOn) => {
    tunable.on = isOn;
    form.remake();
  };
  const { box, element } = tickField([readableName(name), h("small", {}, plugin?.summary)], on, tick);
  box.disabled = !on && plugin?.available === false;
  const room = errorRoom();
  places.add(pointer, box, room);
  const bound = (/** @type {"lower" | "upper"} */ side, /** @type {string} */ label) => numberField({
    label, "aria-label": `${readableName(name)} ${label.toLowerCase()}`, class: "short", placeholder: plugin && !name.includes("=") ? String(plugin.details[side]) : "",
    value: tunable[side], set: form.setter(tunable, side), places, pointer: () => (pointer() === null ? null : `${pointer()}/${side}`),
  });
  const unit = plugin?.details.unit === "1" ? "" : plugin?.details.unit;
  const bounds = on ? h("div", { class: "bounds" }, bound("lower", "From"), bound("upper", "To"), h("span", { class: "note" }, unit)) : null;
  return h("div", { class: "tunable" }, element, whyUnavailable(plugin), bounds, room);
}

const SEARCHES = ["Search for the transferred controller", "Search for the next sample", "Search for a simulator"];

/** Return how much is computed. @param {Form} form */
export function budgetPart(form) {
  const { draft: { budget }, places, catalogue: { budgets } } = form;
  const preset = /** @type {Record<string, any> | undefined} */ (budgets.find(({ name }) => name === budget.preset));
  /** @type {Page.Choices} */
  const choices = budgets.map(({ name }) => [name, readableName(name)]);
  const set = (/** @type {string} */ name) => {
    budget.preset = name;
    form.remake();
  };
  const numbers = EVALUATIONS.map((name, index) => numberField({
    label: SEARCHES[index], hint: "evaluations", placeholder: count(preset?.[name]), value: budget[name],
    set: form.setter(budget, name), places, pointer: `/budget/${name}`,
  }));
  return part("Budget",
    field({ label: "Preset", value: budget.preset, set, pointer: "/budget", places, choices }),
    h("div", { class: "fields" }, ...numbers),
    tickField("Reuse the transferred controller as the next sample, where a strategy would only search for it again. This saves rollouts, but makes comparisons unfair: other strategies select from a search of their own",
      budget.reuse_transfer, form.setter(budget, "reuse_transfer")).element);
}
