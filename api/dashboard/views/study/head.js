// @ts-check
/** The head of a study, or of one experiment: what it is, its progress, and the actions on it. */

import { get } from "../../lib/api.js";
import { requestWords, stateText } from "../../lib/bench/requests.js";
import { h, refill, refillInPlace, setText } from "../../lib/dom.js";
import { downloadLink } from "../../lib/downloads.js";
import { age, count, evaluationsText, percent, readableName, timeBetween, titleOf } from "../../lib/format.js";
import { notesBlock } from "../../lib/markdown.js";
import { progressBar, timeLeft } from "../../lib/progress.js";
import { FIGURE_KINDS } from "../../lib/event_kinds.js";
import { robotPicture } from "../../lib/robot_picture.js";
import { isPhysical, isRecorded, meanText, robotName, worldsText } from "../../lib/robots.js";
import { ENDED, stateBadge } from "../../lib/state_badge.js";
import { factItems } from "../../lib/table.js";
import { tagList } from "../../lib/tags.js";
import { actions, compared, isAmongOthers } from "./actions.js";
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
  const deeds = actions(page);
  const update = () => {
    const { study } = page;
    setText(title, titleOf({ name: study.name, strategy: study.experiments.length > 1 ? "" : study.experiments[0].strategy }));
    document.title = `${ENDED.includes(study.state) ? "" : `${percent(study.progress.share)} · `}${title.textContent} · gaplab`;
    notes.update(study.notes);
    tags.update(study.tags);
    refill(state, `${study.state} ${study.caveat}`, () => stateBadge(study.state, study.caveat));
    bar.update(study.progress);
    whole.hidden = ENDED.includes(study.state);
    const known = factsOf(page);
    refill(facts, JSON.stringify(known), () => factItems(known));
    const warnings = gathered(study, (experiment) => experiment.warnings);
    const reasons = gathered(study, (experiment) => experiment.reasons);
    refill(remarks, JSON.stringify([warnings, reasons]), () =>
      [remarkBlock("Warnings", "warned", warnings), remarkBlock("Why repetitions failed", "broken", reasons)]);
    deeds.update();
  };
  const whole = h("div", { class: "whole" }, bar.element);
  update();
  const element = h("header", { class: "experiment-head" }, trail(page), h("div", { class: "titled" }, title, state, tags.element), verdict(page), deeds.element,
    h("div", { class: "abstract" }, h("div", {}, whole, facts, notes.element), robotPicture(page.robot, page.signal)),
    experiments.length === 1 && isPhysical(experiments[0]) ? waitingRemark(page) : null, remarks, links(page));
  return { element, update };
}

/** Return what the results so far mean, in a sentence, and why. @param {Page.StudyPage} page */
function verdict({ id, sections, signal }) {
  const place = h("div", { class: "conclusion" }, "");  // with a text, sections add no note that it loads
  sections.add(place, ["repetition_completed", ...FIGURE_KINDS], async () => {
    /** @type {Api.VerdictRead} */
    const { headline, sentences } = await get(`/studies/${id}/report`, { format: "json" }, signal);
    refillInPlace(place, JSON.stringify([headline, sentences]), () => [h("p", {}, headline), sentences.length > 0 &&
      h("details", { dataset: { id: "why" } }, h("summary", {}, "Why"), h("ul", {}, ...sentences.map((sentence) => h("li", {}, sentence))))]);
  });
  return place;
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

/** Return what is simulated, tuned and computed, which all experiments of a study share, and how far it is. @param {Page.StudyPage} page @returns {Fact[]} */
function factsOf({ study, unit }) {
  const { experiments: [first, ...others], best, progress } = study;
  const { strategy, direct, level, spec, priority, max_parallel: atOnce } = first;
  const ended = study.experiments.filter(({ state }) => ENDED.includes(state)).length;
  const fitness = others.length ? best : first.fitness;
  const by = best && others.length ? ` by ${titleOf(best)},` : "";
  const tunables = /** @type {{ name: string }[]} */ (spec.tunables).map(({ name }) => name.replaceAll("_", " ")).join(", ");
  const tunes = direct && !others.length ? "" : tunables;
  /** @type {(Fact | false | null)[]} */
  const facts = [
    others.length ? ["Experiments", `${count(ended)} of ${count(others.length + 1)} ended`] : ["Strategy", readableName(strategy)],
    ["Robot", robotName(spec)], ["Engine", worldsText(spec)], tunes !== "" && [level && !others.length ? "Varies" : "Tunes", tunes],
    ["Budget", budgetText(study)],
    fitness && [isRecorded(first) ? "Held-out error" : by ? "Best fitness" : "Fitness in reality", `${meanText(first, fitness.mean)} ${unit(first)}${by} after ${evaluationsText(fitness)} (mean of ${fitness.n})`],
    ["Work", progress.text], ...times(study),
    !others.length && priority !== 0 && ["Priority", priority], !others.length && atOnce !== null && ["At once", `at most ${count(atOnce)}`]];
  return /** @type {Fact[]} */ (facts.filter(Boolean));
}

/** Return the preset and the size of a study; a baseline may have other repetitions. @param {Pick<Api.StudyRead, "experiments">} study */
export function budgetText({ experiments }) {
  const [{ spec }] = experiments;
  const rest = experiments.filter(({ level }) => !level);
  const iterations = Math.max(...(rest.length ? rest : experiments).map((each) => each.spec.iterations));
  const repetitions = [...new Set(experiments.map((each) => each.spec.repetitions))].sort((one, other) => one - other);
  const one = (/** @type {number} */ number) => (number === 1 ? "" : "s");
  return `${readableName(spec.budget.preset)}: ${count(iterations)} iteration${one(iterations)}, ${repetitions.map(count).join(" or ")} repetition${one(repetitions[0])}`;
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
const links = ({ id, study: { experiments } }) => h("p", { class: "links" },
  experiments.length > 1 ? null : h("a", { href: compared({ experiments }) }, "Compare with others"),
  downloadLink("Report", `/studies/${id}/report`, {}, `gaplab-${id}-report.html`, "Writing the report"),
  downloadLink("Archive of everything (.zip)", `/studies/${id}/export`, {}, `gaplab-${id}.zip`));

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
