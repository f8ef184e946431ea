// @ts-check
/** The head of an experiment: what it is, its progress, and the actions on it. */

import { get } from "../../lib/api.js";
import { h, refill, setText } from "../../lib/dom.js";
import { downloadLink } from "../../lib/downloads.js";
import { editNameAndNotes } from "../../lib/edit_dialog.js";
import { age, count, percent, readableName, timeBetween } from "../../lib/format.js";
import { factItems, remarkBlocks } from "../../lib/head_parts.js";
import { newFromThis } from "../../lib/new_from_this.js";
import { fraction, repetitionsDone, timeLeftFact } from "../../lib/progress.js";
import { ENDED, stateBadge } from "../../lib/state_badge.js";
import { actions } from "./actions.js";

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
  const notes = h("p", { class: "notes" });
  const bar = h("progress", { max: 1, "aria-label": "Progress" });
  const facts = h("dl", { class: "facts" });
  const remarks = h("div", { class: "remarks" });
  const buttons = actions(page);
  const update = () => {
    const { experiment } = page;
    const { progress, warnings, reasons } = experiment;
    setText(title, readableName(experiment.name));
    const done = ENDED.includes(experiment.state) ? "" : `${percent(fraction(progress))} · `;
    document.title = `${done}${title.textContent} · gaplab`;
    setText(notes, experiment.notes ?? "");
    notes.hidden = !experiment.notes;
    refill(state, experiment.state, () => stateBadge(experiment.state));
    bar.value = fraction(progress);
    const known = factsOf(experiment);
    refill(facts, JSON.stringify(known), () => factItems(known));
    refill(remarks, JSON.stringify([warnings, reasons]), () =>
      remarkBlocks(warnings.map((text) => ({ text })), reasons.map((text) => ({ text }))));
    buttons.update();
  };
  const edit = () => editNameAndNotes(page, `/experiments/${page.id}`, () => page.experiment);
  const editButton = h("button", { type: "button", class: "quiet small", onclick: edit }, "Edit name and notes");
  update();
  const element = h("header", { class: "experiment-head" }, trail(page), h("div", { class: "titled" }, title, state, editButton, newFromThis(`/experiments/${page.id}`)),
    h("p", { class: "what" }, summary(page.experiment)), notes, bar, facts, remarks, buttons.element, links(page));
  return { element, update };
}

/**
 * Return strategy, robot, engines and tunables in a line.
 *
 * @param {Api.ExperimentRead} experiment
 */
function summary({ strategy, direct, spec }) {
  const engine = spec.engine?.name;
  const realEngine = spec.reality?.engine?.name;
  const engines = engine && realEngine && engine !== realEngine ? `${engine}, reality in ${realEngine}` : engine;
  const tunables = (/** @type {{ name: string }[]} */ (spec.tunables ?? [])).map(({ name }) => name.replaceAll("_", " ")).join(", ");
  const tunes = tunables && !direct ? `tunes ${tunables}` : null;
  return [readableName(strategy), spec.robot?.name.replaceAll("_", " "), engines, tunes].filter(Boolean).join(" · ");
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
 * @param {Api.ExperimentRead} experiment
 * @returns {Fact[]}
 */
function factsOf(experiment) {
  const { progress, max_parallel: maxParallel } = experiment;
  const saved = progress.rollouts_saved ? `, ${count(progress.rollouts_saved)} not needed` : "";
  const broken = progress.rollouts_failed ? `, physics failed in ${count(progress.rollouts_failed)}` : "";
  return [
    ["Done", percent(fraction(progress))],
    ["Repetitions", repetitionsDone(progress)],
    ["Iterations", `${count(progress.iterations_done)} of ${count(progress.iterations)}`],
    ["Rollouts", `${count(progress.rollouts_done)} of ${count(progress.rollouts)}${saved}${broken}`],
    ...times(experiment),
    ["Priority", experiment.priority],
    ["At once", maxParallel === null ? "any number" : `at most ${count(maxParallel)}`],
  ];
}

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
    downloadLink("Archive of everything (.zip)", `/experiments/${id}/export`, {}, `gaplab-${id}.zip`));
}
