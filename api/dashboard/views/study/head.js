// @ts-check
/** The head of a study, or of one experiment: what it is, its progress, and the actions on it. */

import { get } from "../../lib/api.js";
import { requestWords, stateText } from "../../lib/bench/requests.js";
import { h, refill, setText } from "../../lib/dom.js";
import { downloadLink } from "../../lib/downloads.js";
import { age, count, evaluationsText, fixed, percent, readableName, timeBetween, titleOf } from "../../lib/format.js";
import { notesBlock } from "../../lib/markdown.js";
import { progressBar, timeLeft } from "../../lib/progress.js";
import { isPhysical, worldsText } from "../../lib/robots.js";
import { ENDED, stateBadge } from "../../lib/state_badge.js";
import { factItems } from "../../lib/table.js";
import { tagList } from "../../lib/tags.js";
import { actions, editing, isAmongOthers, keeping } from "./actions.js";
import { BENCH_KINDS } from "./measurements.js";

/** @typedef {import("../../lib/table.js").Fact} Fact */
/** @typedef {{ text: string, note: string }} Remark */

const MOST = 100;

/** Return the head, which is updated when `page.study` has changed. @param {Page.StudyPage} page @returns {Page.Updatable} */
export function head(page) {
  const { experiments } = page.study;
  const [title, state, tags] = [h("h1"), h("span", { class: "state-now", role: "status" }), tagList()];
  const notes = notesBlock(`/studies/${experiments[0].study}`, page.signal);
  const bar = progressBar("Progress");
  const [facts, remarks] = [h("dl", { class: "facts" }), h("div", { class: "remarks" })];
  const buttons = [actions(page), keeping(page)];
  const update = () => {
    const { study } = page;
    setText(title, titleOf({ name: study.name, strategy: study.experiments.length > 1 ? "" : study.experiments[0].strategy }));
    document.title = `${ENDED.includes(study.state) ? "" : `${percent(study.progress.share)} · `}${title.textContent} · gaplab`;
    notes.update(study.notes);
    tags.update(study.tags);
    refill(state, `${study.state} ${study.caveat}`, () => stateBadge(study.state, study.caveat));
    bar.update(study.progress);
    const known = factsOf(page);
    refill(facts, JSON.stringify(known), () => factItems(known));
    const warnings = gathered(study, (experiment) => experiment.warnings);
    const reasons = gathered(study, (experiment) => experiment.reasons);
    refill(remarks, JSON.stringify([warnings, reasons]), () =>
      [remarkBlock("Warnings", "warned", warnings), remarkBlock("Why repetitions failed", "broken", reasons)]);
    for (const each of buttons) each.update();
  };
  update();
  const element = h("header", { class: "experiment-head" }, trail(page), h("div", { class: "titled" }, title, state, tags.element, ...editing(page)),
    experiments.length > 1 ? null : h("p", { class: "what" }, summary(experiments[0])), notes.element, h("div", { class: "whole" }, bar.element), facts,
    experiments.length === 1 && isPhysical(experiments[0]) ? waitingRemark(page) : null, remarks,
    h("div", { class: "deeds" }, ...buttons.map((each) => each.element)), links(page));
  return { element, update };
}

/** Return the way to the list, and from one experiment among others to its study. @param {Page.StudyPage} page */
function trail({ study, signal }) {
  const place = h("nav", { "aria-label": "Place", class: "trail" }, h("a", { href: "#/" }, "Studies"));
  if (!isAmongOthers(study)) return place;
  const whole = study.experiments[0].study;
  const link = h("a", { href: `#/studies/${whole}` }, `study ${whole}`);
  get(`/studies/${whole}`, {}, signal).then(({ name }) => { link.textContent = name; }, () => {});
  place.append(" / ", link);
  return place;
}

/** Return strategy, robot, engines and tunables in a line. @param {Api.ExperimentRead} experiment */
function summary({ strategy, direct, level, spec }) {
  const tunables = (/** @type {{ name: string }[]} */ (spec.tunables)).map(({ name }) => name.replaceAll("_", " ")).join(", ");
  const tunes = tunables && !direct ? `${level ? "varies" : "tunes"} ${tunables}` : null;
  return [readableName(strategy), spec.robot.name.replaceAll("_", " "), worldsText(spec), tunes].filter(Boolean).join(" · ");
}

/** @param {Page.StudyPage} page @returns {Fact[]} */
function factsOf({ study, unit }) {
  const { experiments: [first, ...others], best, progress } = study;
  const ended = study.experiments.filter(({ state }) => ENDED.includes(state)).length;
  const fitness = others.length ? best : first.fitness;
  const by = best && others.length ? ` by ${titleOf(best)},` : "";
  const { priority, max_parallel: atOnce } = first;
  /** @type {Fact[]} */
  const several = [["Experiments", `${count(ended)} of ${count(others.length + 1)} ended`]];
  /** @type {Fact[]} */
  const reached = fitness ? [[by ? "Best fitness" : "Fitness in reality", `${fixed(fitness.mean)} ${unit(first)}${by} after ${evaluationsText(fitness)} (mean of ${fitness.n})`]] : [];
  return [...(others.length ? several : []), ["Work", progress.text], ...reached, ...times(study),
    ...(others.length ? [] : [/** @type {Fact} */ (["Priority", priority]), /** @type {Fact} */ (["At once", atOnce === null ? "any number" : `at most ${count(atOnce)}`])])];
}

/** Return when it ended and how long it took, or what is left and when it began. @param {Api.StudyRead} study @returns {Fact[]} */
function times(study) {
  const known = (/** @type {"started_at" | "ended_at"} */ name) => study.experiments.map((experiment) => experiment[name]).filter((time) => time !== null).sort();
  const [[began], ends] = [known("started_at"), known("ended_at")];
  const last = ends.at(-1);
  if (last && ends.length === study.experiments.length) return [["Ended", age(last)], ...(began ? [/** @type {Fact} */ (["Took", timeBetween(began, last)])] : [])];
  return [["Time left", timeLeft(study, "–")], began ? ["Began", age(began)] : ["Submitted", age(study.created_at)]];
}

/**
 * Return the texts of all experiments, each text once, with the experiments that have it unless all have.
 * @param {Pick<Api.StudyRead, "experiments">} study
 * @param {(experiment: Api.ExperimentRead) => string[]} textsOf
 * @returns {Remark[]}
 */
export function gathered({ experiments }, textsOf) {
  /** @type {Map<string, string[]>} */
  const namesByText = new Map();
  for (const experiment of experiments) {
    for (const text of textsOf(experiment)) namesByText.set(text, [...(namesByText.get(text) ?? []), experiment.name]);
  }
  return [...namesByText].map(([text, names]) => ({ text, note: names.length === experiments.length ? "" : names.join(", ") }));
}

/** @param {string} title @param {string} cssClass @param {Remark[]} remarks */
function remarkBlock(title, cssClass, remarks) {
  const items = remarks.map(({ text, note }) => h("li", {}, text, note ? h("span", { class: "note" }, ` (${note})`) : null));
  return items.length ? h("div", { class: `remark ${cssClass}` }, h("strong", {}, title), h("ul", {}, ...items)) : null;
}

/** @param {Page.StudyPage} page */
function links({ id, study: { experiments }, isFunction }) {
  const [{ id: first }, ...others] = experiments;
  const replay = isFunction ? h("a", { href: `#/toy?experiment=${first}` }, "Step through the function") : h("a", { href: `#/replay?experiment=${first}` }, "Replay a controller");
  return h("p", { class: "links" },
    h("a", { href: `#/compare?experiments=${experiments.map((experiment) => experiment.id).join(",")}` }, others.length ? "Compare its experiments" : "Compare with others"),
    others.length ? null : replay,
    downloadLink("Report", `/studies/${id}/report`, {}, `gaplab-${id}-report.html`, "Writing the report"),
    downloadLink("Archive of everything (.zip)", `/studies/${id}/export`, {}, `gaplab-${id}.zip`));
}

/** Return a remark with the measurements that an experiment waits for; nothing while there are none. @param {Page.StudyPage} page */
function waitingRemark({ study: { experiments: [{ id }] }, sections, signal }) {
  const place = h("div", { class: "remarks", role: "status" }, "");  // with a text, sections add no note that it loads
  sections.add(place, [...BENCH_KINDS, "waiting", "resumed", "paused"], async () => {
    /** @type {{ items: Api.RequestRead[], next: string | null }} */
    const { items, next } = await get("/requests", { experiment: id, limit: MOST }, signal);
    place.replaceChildren(...(items.length ? [h("div", { class: "remark" }, h("p", {}, `${waitingText(items, next !== null)} `),
      h("a", { class: "button", href: `#/bench?experiment=${id}` }, "To the bench"))] : []));
  });
  return place;
}

/**
 * Return in a sentence what is waited for.
 * @param {Pick<Api.RequestRead, "bench" | "repetition" | "iteration" | "kind" | "state" | "taken_by" | "unanswered" | "busy">[]} requests
 * @param {boolean} isMore whether there are more than these
 */
export function waitingText(requests, isMore = false) {
  const [first] = requests;
  const others = requests.length - 1;
  const rest = others ? `, and for ${isMore ? "more than " : ""}${count(others)} ${others === 1 ? "other" : "others"}` : "";
  return `It waits for a measurement on the bench “${first.bench}”: ${requestWords(first)} (${stateText(first).replace(/^\S+ /, "")})${rest}.`;
}
