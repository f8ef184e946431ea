// @ts-check
/** The head of a study: its name and notes, its progress, and the actions on it. */

import { h, refill, setText } from "../../lib/dom.js";
import { downloadLink } from "../../lib/downloads.js";
import { editNameAndNotes } from "../../lib/edit_dialog.js";
import { age, count, fixed, readableName } from "../../lib/format.js";
import { factItems, remarkBlocks } from "../../lib/head_parts.js";
import { newFromThis } from "../../lib/new_from_this.js";
import { progressBar, repetitionsDone, timeLeftFact } from "../../lib/progress.js";
import { stateBadge } from "../../lib/state_badge.js";
import { actions } from "./actions.js";

/** @typedef {import("../../lib/head_parts.js").Fact} Fact */

/**
 * Return the head, which is updated when `page.study` has changed.
 *
 * @param {Page.StudyPage} page
 * @returns {Page.Updatable}
 */
export function head(page) {
  const title = h("h1");
  const state = h("span", { class: "state-now", role: "status" });
  const notes = h("p", { class: "notes" });
  const bar = progressBar("Progress");
  const facts = h("dl", { class: "facts" });
  const remarks = h("div", { class: "remarks" });
  const buttons = actions(page);
  const update = () => {
    const { study } = page;
    setText(title, study.name);
    document.title = `${study.name} · gaplab`;
    setText(notes, study.notes ?? "");
    notes.hidden = !study.notes;
    refill(state, study.state, () => stateBadge(study.state));
    bar.update(study.progress);
    const known = factsOf(page);
    refill(facts, JSON.stringify(known), () => factItems(known));
    const warnings = gathered(study, ({ warnings }) => warnings);
    const reasons = gathered(study, ({ reasons }) => reasons);
    refill(remarks, JSON.stringify([warnings, reasons]), () => remarkBlocks(warnings, reasons));
    buttons.update();
  };
  const edit = () => editNameAndNotes(page, `/studies/${page.id}`, () => page.study);
  update();
  const trail = h("nav", { "aria-label": "Place", class: "trail" }, h("a", { href: "#/" }, "Studies"));
  const editButton = h("button", { type: "button", class: "quiet small", onclick: edit }, "Edit name and notes");
  const element = h("header", { class: "experiment-head" }, trail, h("div", { class: "titled" }, title, state, editButton, newFromThis(`/studies/${page.id}`)),
    notes, h("div", { class: "whole" }, bar.element), facts, remarks, buttons.element, links(page));
  return { element, update };
}

/**
 * @param {Page.StudyPage} page
 * @returns {Fact[]}
 */
function factsOf({ study, unit }) {
  const { progress, experiments } = study;
  const [best] = experiments.filter(hasFitness).sort((a, b) => b.best_fitness - a.best_fitness);
  const ended = experiments.filter(({ ended_at: endedAt }) => endedAt).length;
  return [
    ["Experiments", `${count(ended)} of ${count(experiments.length)} ended`],
    ["Repetitions", repetitionsDone(progress)],
    ["Rollouts", `${count(progress.rollouts_done)} of ${count(progress.rollouts)}, ${count(progress.rollouts_saved)} not needed`],
    ...(best ? [/** @type {Fact} */ (["Best fitness", `${fixed(best.best_fitness)} ${unit(best)} by ${readableName(best.name)}`])] : []),
    ...times(study),
  ];
}

/** @type {(experiment: Api.ExperimentRead) => experiment is Api.ExperimentRead & { best_fitness: number }} */
const hasFitness = (experiment) => experiment.best_fitness !== null;

/**
 * @param {Api.StudyRead} study
 * @returns {Fact[]}
 */
function times(study) {
  const ends = study.experiments.map(({ ended_at: endedAt }) => endedAt).filter((endedAt) => endedAt !== null);
  const last = ends.sort().at(-1);
  if (last && ends.length === study.experiments.length) return [["Ended", age(last)]];
  return [["Time left", timeLeftFact(study)], ["Submitted", age(study.created_at)]];
}

/**
 * Return the texts of all experiments, each text once, with the experiments that have it unless all have.
 *
 * @param {Api.StudyRead} study
 * @param {(experiment: Api.ExperimentRead) => string[]} textsOf
 */
export function gathered({ experiments }, textsOf) {
  /** @type {Map<string, string[]>} */
  const namesByText = new Map();
  for (const experiment of experiments) {
    for (const text of textsOf(experiment)) namesByText.set(text, [...(namesByText.get(text) ?? []), experiment.name]);
  }
  return [...namesByText].map(([text, names]) => ({ text, note: names.length === experiments.length ? "" : names.join(", ") }));
}

/** @param {Page.StudyPage} page */
function links({ id, study }) {
  const ids = study.experiments.map((experiment) => experiment.id).join(",");
  return h("p", { class: "links" }, h("a", { href: `#/compare?experiments=${ids}` }, "Compare its experiments"),
    downloadLink("Archive of everything (.zip)", `/studies/${id}/export`, {}, `gaplab-${id}.zip`));
}
