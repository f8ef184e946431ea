/** The parts of the form for a new study, made from the catalogue. */

import { h } from "../../lib/dom.js";
import { count, spoken } from "../../lib/format.js";
import { ticked } from "./draft.js";
import { field, numberField, optionFields, tickField, troubleRoom } from "./fields.js";

const part = (title, ...content) => h("fieldset", { class: "part" }, h("legend", {}, title), ...content);

/** Name, how often, how many: what a study is. */
export function extent(form) {
  const { draft, places, catalogue } = form;
  const preset = catalogue.budgets.find((each) => each.name === draft.budget.preset);
  const counted = (name, label, hint, usual) =>
    numberField({ label, hint, value: draft[name], set: form.set(draft, name), pointer: `/${name}`, places, placeholder: usual ?? "" });
  return part("Study",
    field({ label: "Name", value: draft.name, set: form.set(draft, "name"), pointer: "/name", places, maxlength: 200, placeholder: "study" }),
    h("div", { class: "fields" },
      counted("iterations", "Iterations", "real-world evaluations of a repetition", preset && count(preset.iterations)),
      counted("repetitions", "Repetitions", "of each strategy", preset && count(preset.repetitions)),
      counted("direct_repetitions", "Repetitions of the direct baseline", "", "as the strategies"),
      counted("seed", "Seed", "the same seed gives the same numbers", "0"),
      counted("priority", "Priority", "−10 to 10; the higher is computed first", "0"),
      counted("max_parallel", "Repetitions at once", "of an experiment", "any number")));
}

/** The strategies that are compared, each with its options; one can be there several times. */
export function strategies(form) {
  const { draft, places, catalogue } = form;
  const trouble = troubleRoom();
  const list = h("div", { class: "strategies" }, ...draft.strategies.map((each) =>
    strategy(form, each, catalogue.strategies.find((one) => one.name === each.name))));
  places.add(() => "/strategies", list, trouble);
  const all = (on) => h("button", { type: "button", class: "link", onclick: () => {
    for (const each of draft.strategies) each.on = on;
    form.remake();
  } }, on ? "All" : "None");
  return part("Strategies", h("p", { class: "note" }, "One experiment each, all else equal. ", all(true), " ", all(false)), trouble, list);
}

function strategy(form, each, plugin) {
  const { draft, places } = form;
  const trouble = troubleRoom();
  const pointer = () => (each.on ? `/strategies/${ticked(draft.strategies).indexOf(each)}` : null);
  const others = draft.strategies.filter((one) => one.name === each.name);
  const again = h("button", { type: "button", class: "link", onclick: () => {
    draft.strategies.splice(draft.strategies.indexOf(each) + 1, 0, { name: each.name, options: { ...each.options }, on: true });
    form.remake();
  } }, "Once more, with other options");
  const away = others.length > 1 ? h("button", { type: "button", class: "link", onclick: () => {
    draft.strategies.splice(draft.strategies.indexOf(each), 1);
    form.remake();
  } }, "Remove") : null;
  const options = optionFields(plugin, each.options, pointer, form);
  const box = tickField(h("span", {}, spoken(each.name), h("small", {}, plugin.summary)), each.on, (on) => { each.on = on; form.remake(); });
  places.add(pointer, box.querySelector("input"), trouble);
  const open = Object.keys(each.options).length > 0;
  const more = options && each.on ? h("details", { open }, h("summary", {}, "Options"), options, h("p", {}, again, " ", away)) : null;
  return h("div", { class: "strategy" }, box, trouble, more);
}

/** Robot, engine, optimizer: what is simulated, and by what. */
export function simulation(form) {
  const { draft, catalogue } = form;
  const robot = catalogue.robots.find((each) => each.name === draft.robot.name);
  const own = robot ? `The robot’s own: ${robot.details.engine}` : "The robot’s own";
  return part("Simulation",
    choice(form, "Robot", draft.robot, catalogue.robots, "/robot"),
    choice(form, "Engine of the simulators", draft.engine, catalogue.engines, "/engine", own),
    choice(form, "Optimizer", draft.optimizer, catalogue.optimizers, "/optimizer"));
}

/** A plug-in to choose, with its options; those that are not installed say how to. */
function choice(form, label, ref, plugins, pointer, own = null) {
  const chosen = plugins.find((each) => each.name === ref.name);
  const names = plugins.map((each) => [each.name, `${spoken(each.name)}${each.available ? "" : ": not installed"}`, !each.available]);
  const set = (name) => {
    Object.assign(ref, { name, options: {} });
    form.remake();
  };
  const options = optionFields(chosen, ref.options, () => pointer, form);
  const absent = plugins.filter((each) => !each.available).map((each) => h("p", { class: "note" }, spoken(each.name), " is ", h("code", {}, each.note)));
  return [
    field({ label, hint: chosen?.summary ?? "", value: ref.name, set, pointer, places: form.places, choices: own === null ? names : [["", own], ...names] }),
    ...absent, options ? h("details", { open: Object.keys(ref.options).length > 0 }, h("summary", {}, `Options of ${spoken(ref.name)}`), options) : null];
}

/** What is tuned, between which bounds. */
export function tunables(form) {
  const trouble = troubleRoom();
  const list = h("div", {}, ...form.draft.tunables.map((each) => tunable(form, each)));
  form.places.add(() => "/tunables", list, trouble);
  return part("What is tuned", trouble, list);
}

function tunable(form, each) {
  const { draft, places, catalogue } = form;
  const { summary, details } = catalogue.tunables.find((one) => one.name === each.name);
  const at = () => (each.on ? `/tunables/${ticked(draft.tunables).indexOf(each)}` : null);
  const tick = (on) => {
    each.on = on;
    form.remake();
  };
  const box = tickField(h("span", {}, spoken(each.name), h("small", {}, summary)), each.on, tick);
  const trouble = troubleRoom();
  places.add(at, box.querySelector("input"), trouble);
  const bound = (side, words) => numberField({
    label: words, "aria-label": `${spoken(each.name)} ${words.toLowerCase()}`, class: "short", placeholder: String(details[side]),
    value: each[side], set: form.set(each, side), places, pointer: () => (at() === null ? null : `${at()}/${side}`),
  });
  const unit = h("span", { class: "note" }, details.unit === "1" ? "" : details.unit);
  const bounds = each.on ? h("div", { class: "bounds" }, bound("lower", "From"), bound("upper", "To"), unit) : null;
  return h("div", { class: "tunable" }, box, bounds, trouble);
}

/** The reality that is asked: its engine and its hidden parameters. */
export function reality(form) {
  const { draft, places, catalogue } = form;
  const fields = catalogue.tunables.map(({ name, details }) => numberField({
    label: spoken(name), value: draft.truth[name], set: form.set(draft.truth, name), places, placeholder: "the robot’s own",
    pointer: `/reality/parameters/${name}`, hint: `${details.least} to ${details.greatest}` }));
  return part("Reality",
    h("p", { class: "note" }, "Hidden from the strategies, and from everybody until the study has ended."),
    choice(form, "Engine of reality", draft.real, catalogue.engines, "/reality/engine", "The same as of the simulators"),
    h("div", { class: "fields" }, ...fields));
}

const SEARCHES = [
  ["controller_evaluations", "Search for the transferred controller"],
  ["selection_evaluations", "Search for the next sample"],
  ["simulator_evaluations", "Search for a simulator"],
];

/** How much is computed. */
export function budget(form) {
  const { draft: { budget: found }, places, catalogue: { budgets } } = form;
  const preset = budgets.find((each) => each.name === found.preset);
  const choices = budgets.map((each) => [each.name, spoken(each.name)]);
  const set = (name) => {
    found.preset = name;
    form.remake();
  };
  const numbers = SEARCHES.map(([name, label]) => numberField({
    label, hint: "evaluations", placeholder: count(preset?.[name]), value: found[name], set: form.set(found, name), places, pointer: `/budget/${name}`,
  }));
  return part("Budget",
    field({ label: "Preset", value: found.preset, set, pointer: "/budget", places, choices }),
    h("div", { class: "fields" }, ...numbers),
    tickField("Simulated fit tries the controller that was just transferred, instead of searching for it again",
      found.reuse_transfer, form.set(found, "reuse_transfer")));
}
