/** Rows of the list: a study, which can be opened, and an experiment, by itself or below its study. */

import { h, refill } from "../../lib/dom.js";
import { age, fixed, spoken } from "../../lib/format.js";
import { pill } from "../../lib/pill.js";
import { progressBar, timeLeft } from "../../lib/progress.js";
import { say } from "../../lib/rows.js";
import { tick } from "./selection.js";

/** The columns, with what a narrow window leaves out. */
const COLUMNS = [
  ["", "ticks"], ["Name", "name"], ["State", "stands"], ["Progress", "progress"],
  ["Time left", "left wide"], ["Best fitness", "best"], ["Submitted", "age wide"],
];

/** The head of the list. */
export const heads = () => COLUMNS.map(([words, key]) =>
  h("th", { scope: "col", class: key, title: TOLD[key] ?? null }, words || h("span", { class: "away" }, "Select")));

const TOLD = { best: "The best recorded fitness of each repetition so far, on average; of a study, its best experiment’s" };

/** What every row has; `title` is the link of its name, `sub` the words below. */
function row(kind, name, page, before = null) {
  const box = tick(`Select ${name}`, page.ticked);
  const title = h("a", {});
  const sub = h("span", { class: "sub" });
  const bar = progressBar(`Progress of ${name}`);
  const cells = Object.fromEntries(COLUMNS.map(([, key]) => [key.split(" ")[0], h("td", { class: key })]));
  cells.ticks.append(box.element);
  cells.name.append(h("div", { class: "named" }, before, h("span", {}, title, sub)));
  cells.progress.append(bar.element);
  const element = h("tr", { class: kind }, ...Object.values(cells));
  const update = (item, { words, link, below, ids, best, unit }) => {
    say(title, words);
    title.href = link;
    say(sub, below);
    box.update(ids);
    bar.update(item.progress);
    refill(cells.stands, item.state, () => pill(item.state));
    say(cells.left, timeLeft(item));
    refill(cells.best, `${best} ${unit}`, () => (best === null ? "–" : [fixed(best), h("span", { class: "unit" }, ` ${unit}`)]));
    say(cells.age, age(item.created_at));
    cells.age.title = new Date(item.created_at).toLocaleString();
  };
  return { element, update };
}

/** A study's row: its experiments follow it while it is open. */
export function studyRow({ value: first }, page) {
  const toggle = h("button", { type: "button", class: "toggle", onclick: () => page.toggle(first.id) });
  const made = row("study", first.name, page, toggle);
  const update = ({ value: study }) => {
    const isOpen = page.open.has(study.id);
    toggle.setAttribute("aria-expanded", String(isOpen));
    toggle.setAttribute("aria-label", `Experiments of ${study.name}`);
    const found = study.experiments.map((each) => each.best_fitness).filter((each) => each !== null);
    const count = study.experiments.length;
    made.update(study, {
      words: study.name,
      link: `#/studies/${study.id}`,
      below: `${count} ${count === 1 ? "experiment" : "experiments"}${about(study.experiments[0])}`,
      ids: study.experiments.map((each) => each.id),
      best: found.length ? Math.max(...found) : null,
      unit: page.unit(study.experiments[0]),
    });
  };
  return { element: made.element, update };
}

/** An experiment's row. */
export function experimentRow({ value: first, nested }, page) {
  const made = row(nested ? "experiment nested" : "experiment", first.name, page);
  const update = ({ value: experiment }) => made.update(experiment, {
    words: spoken(experiment.name),
    link: `#/experiments/${experiment.id}`,
    below: nested ? "" : `${spoken(experiment.strategy)}${about(experiment)}`,
    ids: [experiment.id],
    best: experiment.best_fitness,
    unit: page.unit(experiment),
  });
  return { element: made.element, update };
}

/** Robot and engines, in few words. */
function about(experiment) {
  if (!experiment) return "";
  const { robot, engine, reality } = experiment.spec;
  const real = reality?.engine?.name;
  return ` · ${spoken(robot.name)} · ${engine.name}${real && real !== engine.name ? ` for ${real}` : ""}`;
}
