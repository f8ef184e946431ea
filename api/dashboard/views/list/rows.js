// @ts-check
/** Rows of the list: a study, which can be unfolded if it has several experiments, and an experiment below it. */

import { h, refill, setText } from "../../lib/dom.js";
import { age, count, evaluationsText, fromBefore, readableName, titleOf } from "../../lib/format.js";
import { progressBar, timeLeft } from "../../lib/progress.js";
import { meanText, robotName, worldsText } from "../../lib/robots.js";
import { stateBadge } from "../../lib/state_badge.js";
import { tagList } from "../../lib/tags.js";
import { tickBox } from "./selection.js";

/** @typedef {{ value: Api.StudyRead | Api.ExperimentRead, isNested?: boolean }} Row */

/**
 * @typedef {object} List what the rows need of their list
 * @property {(experiment: Api.ExperimentRead | undefined) => string} unit of fitness
 * @property {() => void} ticked
 * @property {Set<string>} [unfolded] the studies whose experiments follow them
 * @property {(id: string) => void} [toggle]
 */

/** The columns, with the order that a first press of the head gives; a narrow window leaves out those that are wide. */
const COLUMNS = [
  { label: "", key: "ticks" }, { label: "Name", key: "name", sort: "name" }, { label: "State", key: "stands", sort: "state" },
  { label: "Progress", key: "progress" }, { label: "Time left", key: "left", wide: true },
  { label: "Fitness", key: "best", sort: "-fitness", title: "Mean fitness in reality over repetitions, as on the curve, after the number of real-world evaluations beside it; of several experiments, that of the best" },
  { label: "Submitted", key: "age", sort: "-created_at", wide: true },
];

/** @param {{ key: string, wide?: boolean }} column */
const classOf = ({ key, wide }) => (wide ? `${key} wide` : key);

/**
 * Return a table with its head, its body, which is empty, and a function that shows the order in the head.
 * @param {string} caption for screen readers
 * @param {{ cssClass?: string, sorted?: (order: string) => void }} [options] `sorted` is called with the order that a press of a head asks for
 */
export function listTable(caption, { cssClass = "", sorted } = {}) {
  let order = "";
  const press = (/** @type {string} */ sort) => () => sorted?.(sort === order ? reversed(sort) : sort);
  const head = COLUMNS.map((column) => h("th", { scope: "col", class: classOf(column), title: column.title },
    column.sort && sorted ? h("button", { type: "button", class: "sort", onclick: press(column.sort) }, column.label) : column.label || h("span", { class: "away" }, "Select")));
  const showOrder = (/** @type {string} */ shown) => {
    order = shown;
    COLUMNS.forEach(({ sort }, index) => {
      if (!sort || bare(sort) !== bare(order)) head[index].removeAttribute("aria-sort");
      else head[index].setAttribute("aria-sort", order.startsWith("-") ? "descending" : "ascending");
    });
  };
  const body = h("tbody");
  return { body, showOrder, element: h("table", { class: `list ${cssClass}` }, h("caption", { class: "away" }, caption), h("thead", {}, h("tr", {}, ...head)), body) };
}

/** @param {string} sort */
const bare = (sort) => sort.replace("-", "");

/** @param {string} sort */
const reversed = (sort) => (sort.startsWith("-") ? bare(sort) : `-${sort}`);

/** Return whether a row stands for several experiments. @param {Row["value"]} value */
export const isSeveral = (value) => "experiments" in value && value.experiments.length !== 1;

/** Return a row. @param {Row} first what it shows when it is made @param {List} list @returns {Page.Updatable<Row>} */
export function listRow({ value: first, isNested = false }, list) {
  const box = tickBox(`Select ${first.name}`, list.ticked);
  const toggle = isSeveral(first) ? h("button", { type: "button", class: "toggle", onclick: () => list.toggle?.(first.id) }) : null;
  const [link, subtitle, tags, bar] = [h("a", {}), h("span", { class: "sub" }), tagList(), progressBar(`Progress of ${first.name}`)];
  const cells = Object.fromEntries(COLUMNS.map((column) => [column.key, h("td", { class: classOf(column) })]));
  cells.ticks.append(box.element);
  cells.name.append(h("div", { class: "named" }, toggle ?? "", h("span", {}, link, tags.element, subtitle)));
  cells.progress.append(bar.element);
  const update = (/** @type {Row} */ { value }) => {
    const experiments = "experiments" in value ? value.experiments : [value];
    const fitness = "best" in value && isSeveral(value) ? value.best : experiments[0]?.fitness;
    const unit = list.unit(experiments[0]);
    setText(link, titleOf({ name: value.name, strategy: isSeveral(value) ? "" : experiments[0].strategy }));
    link.href = `#/${isNested ? "experiments" : "studies"}/${value.id}`;
    setText(subtitle, isNested ? "" : subtitleOf(experiments));
    tags.update("tags" in value ? value.tags : []);
    box.update(value);
    bar.update(value.progress);
    toggle?.setAttribute("aria-expanded", String(list.unfolded?.has(value.id)));
    toggle?.setAttribute("aria-label", `Experiments of ${value.name}`);
    refill(cells.stands, `${value.state} ${value.caveat}`, () => stateBadge(value.state, value.caveat));
    setText(cells.left, timeLeft(value));
    refill(cells.best, JSON.stringify([fitness, unit]), () => (fitness ? fitnessParts(experiments[0], fitness, unit) : "–"));
    setText(cells.age, age(value.created_at));
    cells.age.title = new Date(value.created_at).toLocaleString();
  };
  return { element: h("tr", { class: isNested ? "experiment nested" : "study" }, ...Object.values(cells)), update };
}

/** Return the number of experiments, or the strategy of one alone, with robot and engines. @param {Api.ExperimentRead[]} experiments */
function subtitleOf(experiments) {
  const [first] = experiments;
  const what = experiments.length === 1 ? readableName(first.strategy) : `${count(experiments.length)} experiments`;
  return [what, ...(first ? [robotName(first.spec), worldsText(first.spec)] : [])].join(" · ");
}

/** Return a fitness with its number of real-world evaluations. @param {Api.ExperimentRead} first @param {Api.FitnessRead | Api.BestRead} fitness @param {string} unit */
function fitnessParts(first, fitness, unit) {
  const by = "name" in fitness ? `${titleOf(fitness)}: ` : "";
  const title = `${by}mean of ${fitness.n} after ${evaluationsText(fitness)}`;
  return h("span", { title }, meanText(first, fitness.mean), h("span", { class: "unit" }, ` ${unit}`), h("small", { class: "at" }, ` at ${fitness.evaluations}${fromBefore(fitness.known)}`));
}
