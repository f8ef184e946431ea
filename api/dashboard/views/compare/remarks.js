/** What one must know before one believes a comparison: different robots, different realities. */

import { h, refill } from "../../lib/dom.js";
import { letter } from "./list.js";

const OTHERS = { engine: "engine", tunables: "tunables", budget: "budget", optimizer: "optimizer", iterations: "number of iterations" };

/** Warnings in words, and what else differs. */
export function remarks(view) {
  const element = h("div", { class: "remarks", role: "status" });
  const update = () => {
    const found = view.choice.experiments.map((id, at) => [letter(at), view.books.get(id)]).filter(([, each]) => each);
    const said = warnings(found);
    const also = others(found);
    refill(element, JSON.stringify([said, also]), () => [
      said.length ? h("div", { class: "remark warned" }, ...said.map((each) => h("p", {}, each))) : "",
      also.length ? h("p", { class: "note" }, `They also differ in: ${also.join(", ")}.`) : "",
    ]);
  };
  return { element, update };
}

/** Sentences about experiments that should not be compared; each is `[letter, experiment]`. */
export function warnings(found) {
  const robots = groups(found, (each) => text(each.spec.robot));
  const realities = groups(found, reality(found));
  const said = [];
  if (robots.length > 1) {
    const which = named(robots, ({ spec }) => plugin(spec.robot, found.map(([, each]) => each.spec.robot)));
    said.push(`⚠ Different robots: ${which}. Their fitness does not mean the same, and differences between them say nothing.`);
  }
  if (realities.length > 1 && realities.some(({ key }) => key.startsWith("hidden"))) {
    said.push("⚠ Some realities are hidden until their experiments have ended: whether all of these have the same cannot be said yet.");
  } else if (realities.length > 1) {
    said.push(`⚠ Different realities: ${named(realities, (each) => told(each, found))}. A difference may come from the reality, not from the strategy.`);
  }
  return said;
}

/** Which other settings are not the same. */
export function others(found) {
  const iterative = found.filter(([, each]) => each.strategy !== "direct");
  return Object.keys(OTHERS).filter((key) => groups(iterative, ({ spec }) => text(spec[key])).length > 1).map((key) => OTHERS[key]);
}

function groups(found, keyOf) {
  const kept = new Map();
  for (const [short, each] of found) {
    const key = keyOf(each);
    kept.set(key, [...(kept.get(key) ?? []), [short, each]]);
  }
  return [...kept].map(([key, members]) => ({ key, members }));
}

/** What tells realities apart: all experiments of a study have one, also where it is hidden. */
function reality(found) {
  const shown = found.map(([, each]) => each).filter((each) => each.study && !hidden(each));
  const known = new Map(shown.map((each) => [each.study, text(each.spec.reality)]));
  const unknown = (each) => `hidden ${each.study ?? each.id} ${text(each.spec.reality.engine)}`;
  return (each) => (hidden(each) ? known.get(each.study) ?? unknown(each) : text(each.spec.reality));
}

const hidden = ({ spec }) => Object.values(spec.reality.parameters ?? {}).some((each) => each === null) || !spec.reality.parameters;

function told({ spec: { reality: { engine, parameters } } }, found) {
  const engines = found.map(([, { spec }]) => spec.reality.engine).filter(Boolean);
  return [engine && plugin(engine, engines), ...Object.entries(parameters).map(valued)].filter(Boolean).join(", ");
}

/** Its name, with the options in which it differs from others of that name. */
function plugin({ name, options = {} }, all) {
  const others = all.filter((each) => each.name === name).map((each) => each.options ?? {});
  const own = Object.entries(options).filter(([key, value]) => others.some((each) => text(each[key]) !== text(value)));
  return own.length ? `${name} (${own.map(valued).join(", ")})` : name;
}

const valued = ([name, value]) => `${name.replaceAll("_", " ")} ${text(value)}`;

const named = (all, say) => all.map(({ members }) => `${members.map(([short]) => short).join(", ")}: ${say(members[0][1])}`).join("; ");

/** The same text for equal values, whatever the order of their keys. */
function text(value) {
  return JSON.stringify(value, (_, each) => (each && typeof each === "object" && !Array.isArray(each)
    ? Object.fromEntries(Object.entries(each).sort(([a], [b]) => (a < b ? -1 : 1))) : each)) ?? "";
}
