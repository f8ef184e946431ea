// @ts-check
/** The parts of the form for a new study, made from the catalogue. */

import { h } from "../../lib/dom.js";
import { count, readableName } from "../../lib/format.js";
import { robotPicture } from "../../lib/robot_picture.js";
import { EVALUATIONS, addTunable, plainName, ticked } from "./draft.js";
import { errorRoom, field, folded, numberField, optionFields, pluginField, tickField, whyUnavailable } from "./fields.js";
import { rareReality, realityFields } from "./reality_part.js";

/** @typedef {import("../new.js").Form} Form */

/** Return one of the steps of the form. @param {string} title @param {...Page.Child} content */
const step = (title, ...content) => h("fieldset", { class: "part" }, h("legend", {}, title), ...content);

/** Return what is rarely needed of a step. @param {string} id @param {...Page.Child} content */
const advanced = (id, ...content) => h("div", { class: "advanced" }, folded(id, "Advanced", content));

/** @param {...Page.Child[]} columns */
const columns = (...columns) => h("div", { class: "columns" }, ...columns.map((column) => h("div", {}, ...column)));

/** Return the first step: the robot, what simulates it, and what reality is. @param {Form} form */
export function robotStep(form) {
  const { draft, catalogue } = form;
  const robot = catalogue.robots.find(({ name }) => name === draft.robot.name);
  const ownOf = (/** @type {any} */ { name }) => `The robot’s own: ${readableName(name)}`;
  const robotEngine = `The robot’s own${robot ? `: ${readableName(String(robot.details.engine))}` : ""}`;
  return step("1. The robot",
    columns(
      [pluginField(form, "Robot", draft.robot, catalogue.robots, "/robot"), robotPicture(robot, form.signal)],
      [pluginField(form, "Engine of the simulators", draft.engine, catalogue.engines, "/engine", robotEngine), ...realityFields(form)]),
    advanced("robot", columns(
      robot?.details.controller ? [
        pluginField(form, "Controller", draft.controller, catalogue.controllers ?? [], "/controller", ownOf(robot.details.controller)),
        pluginField(form, "Task", draft.task, catalogue.tasks ?? [], "/task", ownOf(robot.details.task))] : [],
      rareReality(form))));
}

/** Return the second step: what is compared and tuned, and how it searches. @param {Form} form */
export function searchStep(form) {
  const { draft, catalogue, places } = form;
  const ofBudget = catalogue.budgets.find(({ name }) => name === draft.budget.preset)?.controller_optimizer;
  return step("2. What is compared and tuned",
    columns(strategies(form), tunables(form)),
    advanced("search", columns(
      [pluginField(form, "Tuner", draft.tuner, catalogue.tuners, "/tuner"),
        pluginField(form, "Tuning minimises", draft.discrepancy, catalogue.discrepancies, "/discrepancy"),
        numberField({ label: "Share of samples held out", hint: "no tuning sees them, simulators are tested on them; 0.2: each fifth", value: draft.held_out, set: form.setter(draft, "held_out"), pointer: "/held_out", places, placeholder: "0" })],
      [pluginField(form, "Optimizer", draft.optimizer, catalogue.optimizers, "/optimizer"),
        pluginField(form, "Optimizer of controllers", draft.controllerOptimizer, catalogue.optimizers, "/controller_optimizer", ofBudget ? `That of the budget: ${readableName(ofBudget)}` : "The same")])));
}

const SEARCHES = ["Search for the transferred controller", "Search for the next sample", "Search for a simulator"];

/** Return the third step: how much is computed, and the name of the study. @param {Form} form */
export function sizeStep(form) {
  const { draft, draft: { budget }, places, catalogue: { budgets } } = form;
  const preset = /** @type {Record<string, any> | undefined} */ (budgets.find(({ name }) => name === budget.preset));
  /** @type {(name: string, label: string, hint: string, placeholder?: string) => HTMLElement} */
  const countField = (name, label, hint, placeholder = "") =>
    numberField({ label, hint, value: draft[name], set: form.setter(draft, name), pointer: `/${name}`, places, placeholder });
  const set = (/** @type {string} */ name) => {
    budget.preset = name;
    form.remake();
  };
  const searches = EVALUATIONS.map((name, index) => numberField({
    label: SEARCHES[index], hint: "evaluations", placeholder: count(preset?.[name]), value: budget[name],
    set: form.setter(budget, name), places, pointer: `/budget/${name}`,
  }));
  return step("3. Size",
    h("div", { class: "fields" },
      field({ label: "Name", value: draft.name, set: form.setter(draft, "name"), pointer: "/name", places, maxlength: 200, placeholder: "study" }),
      field({ label: "Budget", hint: "how long each search is", value: budget.preset, set, pointer: "/budget", places, choices: budgets.map(({ name }) => [name, readableName(name)]) }),
      countField("iterations", "Iterations", "real-world evaluations of a repetition", preset && count(preset.iterations)),
      countField("repetitions", "Repetitions", "of each strategy", preset && count(preset.repetitions)),
      countField("seed", "Seed", "the same seed gives the same numbers", "0")),
    advanced("size",
      h("div", { class: "fields" }, ...searches,
        countField("direct_repetitions", "Repetitions of the direct baseline", "", "as the strategies"),
        countField("priority", "Priority", "−10 to 10; the highest is computed first", "0"),
        countField("max_parallel", "Repetitions at once", "of an experiment", "any number"),
        ...stopFields(form)),
      tickField("Reuse the transferred controller as the next sample, where a strategy would only search for it again. This saves rollouts, but makes comparisons unfair: other strategies select from a search of their own",
        budget.reuse_transfer, form.setter(budget, "reuse_transfer")).element));
}

/** @type {[name: string, label: string, hint: string, placeholder: string][]} */
const STOP = [
  ["at", "Stop at", "rollouts, seconds, or a cost in your unit: each strategy has as many iterations as stay within it", "all iterations"],
  ["cost_s", "Time of a real-world evaluation", "s", "0"], ["rollout_s", "Time of a rollout on a core", "s", ""],
  ["cores", "Cores", "that share the rollouts", "1"], ["machine", "Price of the machine", "an hour", "1"],
  ["attention", "Price of attention", "an hour of real-world evaluations", "1"], ["wear", "Price of wear", "of one real-world evaluation", "0"],
];

/** Return what may not be exceeded, and the prices. @param {Form} form */
const stopFields = ({ draft: { stop }, places, setter }) => [
  field({ label: "Limit of", value: stop.x ?? "", set: setter(stop, "x"), pointer: "/stop/x", places, choices: [["", "cost"], ["time", "time"], ["rollouts", "rollouts"]] }),
  ...STOP.map(([name, label, hint, placeholder]) => numberField({ label, hint, placeholder, value: stop[name] ?? "", set: setter(stop, name), places, pointer: `/stop/${name}` })),
];

/** Return the strategies that are compared, each with its options; one can be there several times. @param {Form} form */
function strategies(form) {
  const { draft, places } = form;
  const room = errorRoom();
  const list = inTwo(draft.strategies, "strategies", (strategy) => strategyField(form, strategy));
  places.add(() => "/strategies", list, room);
  const tickAll = (/** @type {boolean} */ on) => () => {
    for (const strategy of draft.strategies) strategy.on = on;
    form.remake();
  };
  return [h("h3", {}, "Strategies"), h("p", { class: "note" }, "One experiment each, all else equal. ",
    linkButton("All", tickAll(true)), " ", linkButton("None", tickAll(false))), room, list];
}

/** @type {WeakSet<object>} what was ticked, which stays where it is when it is unticked */
const shown = new WeakSet();

/**
 * Return the fields of what is or was ticked, and behind them, folded, the others.
 *
 * @template {{ on?: boolean }} Ticked
 * @param {Ticked[]} all
 * @param {string} what they are
 * @param {(one: Ticked) => HTMLElement} make
 */
function inTwo(all, what, make) {
  for (const one of ticked(all)) shown.add(one);
  const others = all.filter((one) => !shown.has(one));
  return h("div", { class: what }, ...all.filter((one) => shown.has(one)).map(make),
    others.length ? folded(what, `${count(others.length)} more ${what}`, others.map(make)) : null);
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
    splice(strategies.indexOf(strategy) + 1, 0, { ...strategy, options: { ...strategy.options }, on: true }));
  const isRepeated = strategies.filter(({ name }) => name === strategy.name).length > 1;
  const remove = isRepeated ? linkButton("Remove", () => splice(strategies.indexOf(strategy), 1)) : null;
  const options = optionFields(plugin, strategy, pointer, form);
  const tick = (/** @type {boolean} */ on) => {
    strategy.on = on;
    form.remake();
  };
  const { box, element } = tickField([readableName(strategy.name), h("small", {}, plugin?.summary)], Boolean(strategy.on), tick);
  box.disabled = !strategy.on && plugin?.available === false;
  places.add(pointer, box, room);
  const open = strategy.preset !== "" || Object.keys(strategy.options).length > 0;
  const more = options && strategy.on ? folded(String(pointer()), "Options", [options, h("p", {}, add, " ", remove)], open) : null;
  return h("div", { class: "strategy" }, element, whyUnavailable(plugin), room, more);
}

/** Return what is tuned, and between which bounds. @param {Form} form */
function tunables(form) {
  const room = errorRoom();
  const list = inTwo(form.draft.tunables, "tunables", (tunable) => tunableField(form, tunable));
  form.places.add(() => "/tunables", list, room);
  const label = h("input", { type: "text", placeholder: "mass(trunk)", maxlength: 100, "aria-label": "Tunable of a part of the robot" });
  const add = () => {
    addTunable(form.draft, label.value);
    form.remake();
  };
  return [h("h3", {}, "Tunables"), room, list, h("p", { class: "note" }, "Of a part of the robot, by pattern: ", label, " ", linkButton("Add", add))];
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
