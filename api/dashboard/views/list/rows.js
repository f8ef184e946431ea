// @ts-check
/** Rows of the list: a study, which can be unfolded if it has several experiments, and an experiment below it. Rows are ticked for a comparison. */

import { h, refill, setText } from "../../lib/dom.js";
import { age, count, evaluationsText, fixed, fromBefore, readableName, titleOf } from "../../lib/format.js";
import { progressBar, timeLeft } from "../../lib/progress.js";
import { worldsText } from "../../lib/robots.js";
import { stateBadge } from "../../lib/state_badge.js";
import { tagList } from "../../lib/tags.js";

/** @typedef {{ value: Api.StudyRead | Api.ExperimentRead, isNested?: boolean }} Row */

/**
 * @typedef {object} List what the rows need of their list
 * @property {(experiment: Api.ExperimentRead | undefined) => string} unit of fitness
 * @property {() => void} ticked
 * @property {Set<string>} [unfolded] the studies whose experiments follow them
 * @property {(id: string) => void} [toggle]
 */

/** The columns; a narrow window leaves out those that are wide. */
const COLUMNS = [
  { label: "", key: "ticks" }, { label: "Name", key: "name" }, { label: "State", key: "stands" }, { label: "Progress", key: "progress" },
  { label: "Time left", key: "left", wide: true },
  { label: "Fitness", key: "best", title: "Mean fitness in reality over repetitions, as on the curve, after the number of real-world evaluations beside it; of several experiments, that of the best" },
  { label: "Submitted", key: "age", wide: true },
];

/** @type {Set<string>} the experiments that are ticked; they stay so while the reader visits other parts of the page */
const ticked = new Set();

/** @param {{ key: string, wide?: boolean }} column */
const classOf = ({ key, wide }) => (wide ? `${key} wide` : key);

/** Return a table with its head, and its body, which is empty. @param {string} caption for screen readers @param {string} [cssClass] */
export function listTable(caption, cssClass = "") {
  const head = COLUMNS.map((column) => h("th", { scope: "col", class: classOf(column), title: column.title }, column.label || h("span", { class: "away" }, "Select")));
  const body = h("tbody");
  return { body, element: h("table", { class: `list ${cssClass}` }, h("caption", { class: "away" }, caption), h("thead", {}, h("tr", {}, ...head)), body) };
}

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
    box.update(experiments.map(({ id }) => id));
    bar.update(value.progress);
    toggle?.setAttribute("aria-expanded", String(list.unfolded?.has(value.id)));
    toggle?.setAttribute("aria-label", `Experiments of ${value.name}`);
    refill(cells.stands, `${value.state} ${value.caveat}`, () => stateBadge(value.state, value.caveat));
    setText(cells.left, timeLeft(value));
    refill(cells.best, JSON.stringify([fitness, unit]), () => (fitness ? fitnessParts(fitness, unit) : "–"));
    setText(cells.age, age(value.created_at));
    cells.age.title = new Date(value.created_at).toLocaleString();
  };
  return { element: h("tr", { class: isNested ? "experiment nested" : "study" }, ...Object.values(cells)), update };
}

/** Return the number of experiments, or the strategy of one alone, with robot and engines. @param {Api.ExperimentRead[]} experiments */
function subtitleOf(experiments) {
  const [first] = experiments;
  const what = experiments.length === 1 ? readableName(first.strategy) : `${count(experiments.length)} experiments`;
  return [what, ...(first ? [readableName(first.spec.robot.name), worldsText(first.spec)] : [])].join(" · ");
}

/** Return a fitness with its number of real-world evaluations. @param {Api.FitnessRead | Api.BestRead} fitness @param {string} unit */
function fitnessParts(fitness, unit) {
  const by = "name" in fitness ? `${titleOf(fitness)}: ` : "";
  const title = `${by}mean of ${fitness.n} after ${evaluationsText(fitness)}`;
  return h("span", { title }, fixed(fitness.mean), h("span", { class: "unit" }, ` ${unit}`), h("small", { class: "at" }, ` at ${fitness.evaluations}${fromBefore(fitness.known)}`));
}

/**
 * Return the bar that leads to the comparison of what is ticked.
 * @param {() => void} cleared called when the bar has unticked all
 * @returns {Page.Updatable}
 */
export function selectionBar(cleared) {
  const text = h("span", { role: "status" });
  const compare = h("a", { class: "button" }, "Compare");
  const clear = () => {
    ticked.clear();
    update();
    cleared();
  };
  const element = h("div", { class: "selection", role: "region", "aria-label": "Selected experiments", hidden: true }, text, compare,
    h("button", { type: "button", class: "quiet", onclick: clear }, "Clear"));
  const update = () => {
    element.hidden = ticked.size === 0;
    text.textContent = ticked.size ? `${ticked.size} selected` : "";
    compare.href = `#/compare?experiments=${[...ticked].join(",")}`;
  };
  update();
  return { element, update };
}

/**
 * Return a box that ticks several experiments; it is half ticked while only some of them are.
 * @param {string} label
 * @param {() => void} changed
 * @returns {Page.Updatable<string[]>}
 */
function tickBox(label, changed) {
  /** @type {string[]} */
  let ids = [];
  const tick = () => {
    for (const id of ids) ticked[box.checked ? "add" : "delete"](id);
    changed();
  };
  const box = h("input", { type: "checkbox", "aria-label": label, onchange: tick });
  const update = (/** @type {string[]} */ newIds) => {
    ids = newIds;
    const tickedCount = ids.filter((id) => ticked.has(id)).length;
    box.checked = ids.length > 0 && tickedCount === ids.length;
    box.indeterminate = tickedCount > 0 && tickedCount < ids.length;
  };
  return { element: box, update };
}
