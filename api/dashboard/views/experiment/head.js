// @ts-check
/** The head of an experiment: what it is, its progress, and the actions on it. */

import { get } from "../../lib/api.js";
import { h, refill, setText } from "../../lib/dom.js";
import { downloadLink } from "../../lib/downloads.js";
import { editNameAndNotes } from "../../lib/edit_dialog.js";
import { age, count, evaluationsText, fixed, percent, readableName, timeBetween, titleOf } from "../../lib/format.js";
import { factItems, remarkBlocks } from "../../lib/head_parts.js";
import { keepingButtons } from "../../lib/keeping.js";
import { notesBlock } from "../../lib/markdown.js";
import { isPhysical, worldsText } from "../../lib/robots.js";
import { newFromThis } from "../../lib/new_from_this.js";
import { fraction, timeLeftFact, workFacts } from "../../lib/progress.js";
import { ENDED, stateBadge } from "../../lib/state_badge.js";
import { tagList } from "../../lib/tags.js";
import { actions } from "./actions.js";
import { waitingRemark } from "./waiting.js";

/** @typedef {import("../../lib/head_parts.js").Fact} Fact */

/**
 * Return the head, which is updated when `page.experiment` has changed.
 *
 * @param {Page.ExperimentPage} page
 * @returns {Page.Updatable}
 */
export function head(page) {
  const title = h("h1");
  const state = h("span", { class: "state-now", role: "status" });
  const notes = notesBlock(`/experiments/${page.id}`, page.signal);
  const tags = tagList();
  const keeping = keepingButtons(page, `/experiments/${page.id}`, () => keptOf(page.experiment));
  const bar = h("progress", { max: 1, "aria-label": "Progress" });
  const facts = h("dl", { class: "facts" });
  const remarks = h("div", { class: "remarks" });
  const buttons = actions(page);
  const update = () => {
    const { experiment } = page;
    const { progress, warnings, reasons } = experiment;
    setText(title, titleOf(experiment));
    const done = ENDED.includes(experiment.state) ? "" : `${percent(fraction(progress))} · `;
    document.title = `${done}${title.textContent} · gaplab`;
    notes.update(experiment.notes);
    tags.update(experiment.tags);
    keeping.update();
    refill(state, `${experiment.state} ${experiment.caveat}`, () => stateBadge(experiment.state, experiment.caveat));
    bar.value = fraction(progress);
    const known = factsOf(page);
    refill(facts, JSON.stringify(known), () => factItems(known));
    refill(remarks, JSON.stringify([warnings, reasons]), () =>
      remarkBlocks(warnings.map((text) => ({ text })), reasons.map((text) => ({ text }))));
    buttons.update();
  };
  const edit = () => editNameAndNotes(page, `/experiments/${page.id}`, () => page.experiment);
  const editButton = h("button", { type: "button", class: "quiet small", onclick: edit }, "Edit name, notes and tags");
  update();
  const element = h("header", { class: "experiment-head" }, trail(page), h("div", { class: "titled" }, title, state, tags.element, editButton, newFromThis(`/experiments/${page.id}`)),
    h("p", { class: "what" }, summary(page.experiment)), notes.element, bar, facts, isPhysical(page.experiment) ? waitingRemark(page) : null, remarks, buttons.element, links(page), keeping.element);
  return { element, update };
}

/**
 * Return strategy, robot, engines and tunables in a line.
 *
 * @param {Api.ExperimentRead} experiment
 */
function summary({ strategy, direct, level, spec }) {
  const engines = worldsText(spec);
  const tunables = (/** @type {{ name: string }[]} */ (spec.tunables)).map(({ name }) => name.replaceAll("_", " ")).join(", ");
  const tunes = tunables && !direct ? `${level ? "varies" : "tunes"} ${tunables}` : null;
  return [readableName(strategy), spec.robot.name.replaceAll("_", " "), engines, tunes].filter(Boolean).join(" · ");
}

/** @param {Page.ExperimentPage} page */
function trail({ experiment: { study }, signal }) {
  const place = h("nav", { "aria-label": "Place", class: "trail" }, h("a", { href: "#/" }, "Experiments"));
  if (study) {
    const link = h("a", { href: `#/studies/${study}` }, `study ${study}`);
    get(`/studies/${study}`, {}, signal).then(({ name }) => { link.textContent = name; }, () => {});
    place.append(" / ", link);
  }
  return place;
}

/**
 * @param {Page.ExperimentPage} page
 * @returns {Fact[]}
 */
function factsOf({ experiment, unit }) {
  const { progress, fitness, max_parallel: maxParallel } = experiment;
  return [
    ["Done", percent(fraction(progress))],
    ...workFacts(progress),
    ...(fitness ? [/** @type {Fact} */ (["Fitness in reality", fitnessText(fitness, unit(experiment))])] : []),
    ...times(experiment),
    ["Priority", experiment.priority],
    ["At once", maxParallel === null ? "any number" : `at most ${count(maxParallel)}`],
  ];
}

/** @type {(fitness: Api.FitnessRead, unit: string) => string} */
const fitnessText = (fitness, unit) => `${fixed(fitness.mean)} ${unit} after ${evaluationsText(fitness)} (mean of ${fitness.n})`;

/**
 * @param {Api.ExperimentRead} experiment
 * @returns {Fact[]}
 */
function times({ state, progress, created_at: created, started_at: started, ended_at: ended }) {
  if (ENDED.includes(state) && ended) {
    const took = started ? [/** @type {Fact} */ (["Took", timeBetween(started, ended)])] : [];
    return [["Ended", age(ended)], ...took];
  }
  return [["Time left", timeLeftFact({ state, progress })], started ? ["Began", age(started)] : ["Submitted", age(created)]];
}

/** @param {Page.ExperimentPage} page */
function links({ id, isFunction }) {
  const replay = isFunction
    ? h("a", { href: `#/toy?experiment=${id}` }, "Step through the function")
    : h("a", { href: `#/replay?experiment=${id}` }, "Replay a controller");
  return h("p", { class: "links" }, h("a", { href: `#/compare?experiments=${id}` }, "Compare with others"), " ", replay, " ",
    downloadLink("Report", `/experiments/${id}/report`, {}, `gaplab-${id}-report.html`, "Writing the report"), " ",
    downloadLink("Report as PDF", `/experiments/${id}/report`, { format: "pdf" }, `gaplab-${id}-report.pdf`, "Writing the report"), " ",
    downloadLink("Archive of everything (.zip)", `/experiments/${id}/export`, {}, `gaplab-${id}.zip`));
}

/**
 * Return what archiving and deleting must know of the experiment.
 *
 * @param {Api.ExperimentRead} experiment
 */
const keptOf = ({ name, state, progress, archived_at: archivedAt }) => ({
  name, what: `${count(progress.repetitions)} repetitions`, hasEnded: ENDED.includes(state), isArchived: Boolean(archivedAt),
});
