// @ts-check
/** Rows of the list: a study, which can be unfolded, and an experiment, by itself or below its study. */

import { h, refill, setText } from "../../lib/dom.js";
import { age, evaluationsText, fixed, fromBefore, readableName, titleOf } from "../../lib/format.js";
import { progressBar, timeLeft } from "../../lib/progress.js";
import { worldsText } from "../../lib/robots.js";
import { stateBadge } from "../../lib/state_badge.js";
import { tagList } from "../../lib/tags.js";
import { tickBox } from "./selection.js";

/**
 * @typedef {object} List what the rows need of their list
 * @property {(experiment: Api.ExperimentRead | undefined) => string} unit of fitness
 * @property {() => void} ticked
 */

/** @typedef {List & { unfolded: Set<string>, toggle: (id: string) => void }} StudyList */

/** @typedef {{ value: Api.ExperimentRead, isNested?: boolean }} ExperimentItem */

/** The columns; a narrow window leaves out those that are wide. */
const COLUMNS = [
  { label: "", key: "ticks" }, { label: "Name", key: "name" }, { label: "State", key: "stands" }, { label: "Progress", key: "progress" },
  { label: "Time left", key: "left", wide: true },
  { label: "Fitness", key: "best", title: "Mean fitness in reality over repetitions, as on the curve, after the number of real-world evaluations beside it; of a study, that of its best experiment" },
  { label: "Submitted", key: "age", wide: true },
];

/** @param {{ key: string, wide?: boolean }} column */
const classOf = ({ key, wide }) => (wide ? `${key} wide` : key);

/** Return the cells of the list's head. */
export const headCells = () => COLUMNS.map((column) =>
  h("th", { scope: "col", class: classOf(column), title: column.title }, column.label || h("span", { class: "away" }, "Select")));

/**
 * @typedef {object} Content what a row shows besides state and progress
 * @property {string} title
 * @property {string} link
 * @property {string} subtitle
 * @property {string[]} ids of the experiments that its box ticks
 * @property {Api.FitnessRead | Api.BestRead | null} fitness
 * @property {string} unit
 */

/**
 * Return what the rows of studies and of experiments have in common.
 *
 * @param {string} cssClass
 * @param {string} name
 * @param {List} list
 * @param {HTMLElement | null} [toggle]
 */
function baseRow(cssClass, name, list, toggle = null) {
  const box = tickBox(`Select ${name}`, list.ticked);
  const link = h("a", {});
  const subtitle = h("span", { class: "sub" });
  const tags = tagList();
  const bar = progressBar(`Progress of ${name}`);
  const cells = Object.fromEntries(COLUMNS.map((column) => [column.key, h("td", { class: classOf(column) })]));
  cells.ticks.append(box.element);
  cells.name.append(h("div", { class: "named" }, toggle, h("span", {}, link, tags.element, subtitle)));
  cells.progress.append(bar.element);
  const element = h("tr", { class: cssClass }, ...Object.values(cells));
  /** @type {(item: Api.StudyRead | Api.ExperimentRead, content: Content) => void} */
  const update = (item, { title, link: address, subtitle: words, ids, fitness, unit }) => {
    setText(link, title);
    link.href = address;
    setText(subtitle, words);
    tags.update(item.tags);
    box.update(ids);
    bar.update(item.progress);
    refill(cells.stands, `${item.state} ${item.caveat}`, () => stateBadge(item.state, item.caveat));
    setText(cells.left, timeLeft(item));
    refill(cells.best, JSON.stringify([fitness, unit]), () => fitnessParts(fitness, unit));
    setText(cells.age, age(item.created_at));
    cells.age.title = new Date(item.created_at).toLocaleString();
  };
  return { element, update };
}

/**
 * Return a fitness with its number of real-world evaluations; a dash without a result.
 *
 * @param {Api.FitnessRead | Api.BestRead | null} fitness
 * @param {string} unit
 */
function fitnessParts(fitness, unit) {
  if (!fitness) return "–";
  const by = "name" in fitness ? `${titleOf(fitness)}: ` : "";
  const title = `${by}mean of ${fitness.n} after ${evaluationsText(fitness)}`;
  return h("span", { title }, fixed(fitness.mean), h("span", { class: "unit" }, ` ${unit}`), h("small", { class: "at" }, ` at ${fitness.evaluations}${fromBefore(fitness.known)}`));
}

/**
 * Return the row of a study; its experiments follow it while it is unfolded.
 *
 * @param {Api.StudyRead} first the study as it is when the row is made
 * @param {StudyList} list
 * @returns {Page.Updatable<{ value: Api.StudyRead }>}
 */
export function studyRow(first, list) {
  const toggle = h("button", { type: "button", class: "toggle", onclick: () => list.toggle(first.id) });
  const row = baseRow("study", first.name, list, toggle);
  const update = (/** @type {{ value: Api.StudyRead }} */ { value: study }) => {
    toggle.setAttribute("aria-expanded", String(list.unfolded.has(study.id)));
    toggle.setAttribute("aria-label", `Experiments of ${study.name}`);
    const count = study.experiments.length;
    row.update(study, {
      title: study.name,
      link: `#/studies/${study.id}`,
      subtitle: `${count} ${count === 1 ? "experiment" : "experiments"}${worlds(study.experiments[0])}`,
      ids: study.experiments.map(({ id }) => id),
      fitness: study.best,
      unit: list.unit(study.experiments[0]),
    });
  };
  return { element: row.element, update };
}

/**
 * Return the row of an experiment.
 *
 * @param {ExperimentItem} first the experiment as it is when the row is made
 * @param {List} list
 * @returns {Page.Updatable<ExperimentItem>}
 */
export function experimentRow({ value: first, isNested = false }, list) {
  const row = baseRow(isNested ? "experiment nested" : "experiment", first.name, list);
  const update = (/** @type {ExperimentItem} */ { value: experiment }) => row.update(experiment, {
    title: titleOf(experiment),
    link: `#/experiments/${experiment.id}`,
    subtitle: isNested ? "" : `${experiment.study ? "" : "Single experiment · "}${readableName(experiment.strategy)}${worlds(experiment)}`,
    ids: [experiment.id],
    fitness: experiment.fitness,
    unit: list.unit(experiment),
  });
  return { element: row.element, update };
}

/**
 * Return robot and engines in a few words.
 *
 * @param {Api.ExperimentRead | undefined} experiment
 */
function worlds(experiment) {
  if (!experiment) return "";
  return ` · ${readableName(experiment.spec.robot.name)} · ${worldsText(experiment.spec)}`;
}
