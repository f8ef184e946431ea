// @ts-check
/** The head of a study: its name and notes, its progress, and the actions on it. */

import { h, refill, setText } from "../../lib/dom.js";
import { downloadLink } from "../../lib/downloads.js";
import { editNameAndNotes } from "../../lib/edit_dialog.js";
import { age, count, evaluationsText, fixed, titleOf } from "../../lib/format.js";
import { factItems, remarkBlocks } from "../../lib/head_parts.js";
import { keepingButtons } from "../../lib/keeping.js";
import { notesBlock } from "../../lib/markdown.js";
import { newFromThis } from "../../lib/new_from_this.js";
import { progressBar, timeLeftFact, workFacts } from "../../lib/progress.js";
import { ENDED, stateBadge } from "../../lib/state_badge.js";
import { tagList } from "../../lib/tags.js";
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
  const notes = notesBlock(`/studies/${page.id}`, page.signal);
  const tags = tagList();
  const keeping = keepingButtons(page, `/studies/${page.id}`, () => keptOf(page.study));
  const bar = progressBar("Progress");
  const facts = h("dl", { class: "facts" });
  const remarks = h("div", { class: "remarks" });
  const buttons = actions(page);
  const update = () => {
    const { study } = page;
    setText(title, study.name);
    document.title = `${study.name} · gaplab`;
    notes.update(study.notes);
    tags.update(study.tags);
    keeping.update();
    refill(state, `${study.state} ${study.caveat}`, () => stateBadge(study.state, study.caveat));
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
  const editButton = h("button", { type: "button", class: "quiet small", onclick: edit }, "Edit name, notes and tags");
  const element = h("header", { class: "experiment-head" }, trail, h("div", { class: "titled" }, title, state, tags.element, editButton, newFromThis(`/studies/${page.id}`)),
    notes.element, h("div", { class: "whole" }, bar.element), facts, remarks, buttons.element, links(page), keeping.element);
  return { element, update };
}

/**
 * @param {Page.StudyPage} page
 * @returns {Fact[]}
 */
function factsOf({ study, unit }) {
  const { progress, experiments } = study;
  const ended = experiments.filter(({ ended_at: endedAt }) => endedAt).length;
  return [
    ["Experiments", `${count(ended)} of ${count(experiments.length)} ended`],
    ...workFacts(progress),
    ...bestFact(study, unit(experiments[0])),
    ...times(study),
  ];
}

/**
 * Return the fittest experiment after the last number of evaluations that all share, as in the figure of the curves.
 *
 * @param {Api.StudyRead} study
 * @param {string} unit
 * @returns {Fact[]}
 */
function bestFact({ best }, unit) {
  if (!best) return [];
  return [["Best fitness", `${fixed(best.mean)} ${unit} by ${titleOf(best)}, after ${evaluationsText(best)} (mean of ${best.n})`]];
}

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
    " ", downloadLink("Report", `/studies/${id}/report`, {}, `gaplab-${id}-report.html`, "Writing the report"),
    downloadLink("Report as PDF", `/studies/${id}/report`, { format: "pdf" }, `gaplab-${id}-report.pdf`, "Writing the report"),
    downloadLink("Archive of everything (.zip)", `/studies/${id}/export`, {}, `gaplab-${id}.zip`));
}

/**
 * Return what archiving and deleting must know of the study.
 *
 * @param {Api.StudyRead} study
 */
const keptOf = ({ name, experiments, progress, archived_at: archivedAt }) => ({
  name,
  what: `${count(experiments.length)} experiments and ${count(progress.repetitions)} repetitions`,
  hasEnded: experiments.every(({ state }) => ENDED.includes(state)),
  isArchived: Boolean(archivedAt),
});
