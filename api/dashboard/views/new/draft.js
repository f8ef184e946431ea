/** What the form holds, and the spec that it makes of it: only what was said, for what is left out is the service's own. */

import { numberOf } from "../../lib/json.js";

const COUNTS = ["iterations", "repetitions", "direct_repetitions", "seed", "priority", "max_parallel"];
const EVALUATIONS = ["controller_evaluations", "selection_evaluations", "simulator_evaluations"];
const USUAL_TUNABLES = ["static_friction", "dynamic_friction", "restitution"];

/** A plug-in as the form has it, of a name or of `{ name, options }`. */
const plugin = (given, name = "") => {
  const ref = typeof given === "string" ? { name: given } : given ?? { name };
  return { name: ref.name, options: { ...ref.options } };
};

/** The form's content for a spec, with everything that the catalogue has to choose from. */
export function draftOf(spec, catalogue) {
  const budget = typeof spec.budget === "string" ? { preset: spec.budget } : spec.budget ?? {};
  return {
    name: spec.name ?? "",
    ...Object.fromEntries(COUNTS.map((each) => [each, spec[each] ?? ""])),
    strategies: strategiesOf(spec.strategies?.map((each) => plugin(each)), catalogue),
    robot: plugin(spec.robot, "quadruped"),
    engine: plugin(spec.engine),
    optimizer: plugin(spec.optimizer, "steady_state"),
    tunables: tunablesOf((spec.tunables ?? USUAL_TUNABLES).map((each) => (typeof each === "string" ? { name: each } : each)), catalogue),
    real: plugin(spec.reality?.engine),
    truth: { ...spec.reality?.parameters },
    budget: {
      preset: budget.preset ?? "paper",
      reuse_transfer: budget.reuse_transfer ?? true,
      ...Object.fromEntries(EVALUATIONS.map((each) => [each, budget[each] ?? ""])),
    },
  };
}

/** Those that were named, ticked and in their order, one that was named twice twice; then the others of the catalogue. */
function strategiesOf(named, catalogue) {
  const all = catalogue.strategies.map(({ name }) => ({ name, options: {} }));
  const others = named ? all.filter(({ name }) => !named.some((each) => each.name === name)) : [];
  return [...(named ?? all).map((each) => ({ ...each, on: true })), ...others.map((each) => ({ ...each, on: false }))];
}

function tunablesOf(named, catalogue) {
  return catalogue.tunables.map(({ name }) => {
    const found = named.find((each) => each.name === name);
    return { name, on: Boolean(found), lower: found?.lower ?? "", upper: found?.upper ?? "" };
  });
}

/** The strategies and tunables that are ticked, in their order in the spec. */
export const ticked = (list) => list.filter((each) => each.on);

/** The spec of the form. */
export function specOf(draft) {
  return without({
    name: draft.name.trim(),
    strategies: ticked(draft.strategies).map(named),
    robot: named(draft.robot),
    engine: draft.engine.name ? named(draft.engine) : "",
    optimizer: named(draft.optimizer),
    tunables: ticked(draft.tunables).map(({ name, lower, upper }) => brief({ name, ...without({ lower: given(lower), upper: given(upper) }) })),
    reality: without({ engine: draft.real.name ? named(draft.real) : "", parameters: without(mapped(draft.truth, given)) }),
    budget: budgetOf(draft.budget),
    ...mapped(Object.fromEntries(COUNTS.map((each) => [each, draft[each]])), given),
  }, ["strategies", "tunables"]);
}

function budgetOf({ preset, reuse_transfer: reuse, ...evaluations }) {
  const said = without({ ...mapped(evaluations, given), ...(reuse ? {} : { reuse_transfer: false }) });
  return Object.keys(said).length ? { preset, ...said } : preset;
}

const named = ({ name, options }) => brief({ name, ...without({ options: without(mapped(options, given)) }) });
const brief = (ref) => (Object.keys(ref).length === 1 ? ref.name : ref);
const mapped = (object, way) => Object.fromEntries(Object.entries(object).map(([key, value]) => [key, way(value)]));

/** A number where one was typed; else what was typed, which the service says something about. */
function given(value) {
  if (typeof value !== "string" || !value.trim()) return typeof value === "string" ? "" : value;
  return numberOf(value.trim().replace("−", "-")) ?? value.trim();
}

/** The object without what says nothing. */
function without(object, kept = []) {
  const isEmpty = (value) => value === "" || value === null || value === undefined || (typeof value === "object" && !Object.keys(value).length);
  return Object.fromEntries(Object.entries(object).filter(([key, value]) => kept.includes(key) || !isEmpty(value)));
}
