// @ts-check
/** The measurements of a robot on a bench: repeats, operators, what was corrected, and the way to take one back. Steps that a correction closed. */

import { get } from "../../lib/api.js";
import { conflictList, undoButtons } from "../../lib/bench/corrections.js";
import { answerText, isAtRest, isWanted, requestWords, stateText } from "../../lib/bench/requests.js";
import { h, refill, select } from "../../lib/dom.js";
import { downloadLink } from "../../lib/downloads.js";
import { REWRITES } from "../../lib/event_kinds.js";
import { count, number } from "../../lib/format.js";
import { empty } from "../../lib/placeholders.js";
import { framed, table } from "../../lib/table.js";
import { pagedList, replayLink } from "./samples.js";

const PAGE_SIZE = 50;
/** @type {Page.Choices} */
const CHOICES = [["", "all measurements"], ["pending", "those that wait"], ["conflicts", "those in conflict"]];

/** The events of a bench. */
export const BENCH_KINDS = ["requested", "refused", "taken", "released", "take_expired", "measured", "probed", "conflicting", "corrected", "voided", "decided", "cancelled", "completed"];

/** @type {Record<Api.AnswerState, string>} */
const HISTORY = { counted: "counts", conflict: "in conflict", replaced: "replaced", void: "void", dismissed: "dismissed" };

/** @type {Record<string, string>} */
const ENDED = { failed: "✕ failed", withdrawn: "– no longer needed", measured: "✓ measured" };

/** Return the table, with its filter above and the way to its other pages below. @param {Page.StudyPage} page */
export function measurements(page) {
  const show = select(CHOICES);
  const reload = () => page.reload().then(() => page.sections.reload([]));
  /** @type {{ values: number[] }[]} */
  const known = page.experiment.spec.reality.samples;
  const render = (/** @type {Api.RequestRead[]} */ items, /** @type {boolean} */ isFirst) => {
    const earlier = isFirst && !show.value ? known.slice(0, PAGE_SIZE).map(earlierRow) : [];
    if (!items.length && !earlier.length) return [empty(show.value ? "There are none." : "No measurement was requested yet.")];
    const unit = items[0]?.unit ?? page.unit(page.experiment);
    const columns = ["Repetition", "Iteration", "Kind", `Repeats${unit && ` (${unit})`}`, "Mean", "State", "Operator", "When", "Replay", "Take back"];
    const conflicts = items.filter(({ answers }) => answers.some(({ state }) => state === "conflict"));
    return [conflictList(conflicts, { signal: page.signal, refresh: reload }), table("Measurements", columns, [...earlier, ...items.map((request) => row(page, request, reload))]),
      earlier.length < known.length && earlier.length ? h("p", { class: "note" }, `The spec has all ${count(known.length)} from before.`) : ""];
  };
  return pagedList(page, {
    path: "/requests", size: PAGE_SIZE, kinds: BENCH_KINDS, render,
    filters: h("p", { class: "options" }, h("label", {}, "Show ", show)),
    query: () => ({ experiment: page.experiment.id, pending: show.value === "pending", conflicts: show.value === "conflicts" || null }),
  });
}

/** Return a sample from before the experiment, which every repetition knows. @param {{ values: number[] }} sample */
const earlierRow = ({ values }) => ["all", "–", "sample from before", answerText({ values }), number(values.reduce((sum, each) => sum + each) / values.length), ENDED.measured, "–", "–", "", ""];

/** @param {Page.StudyPage} page @param {Api.RequestRead} request @param {() => unknown} reload */
function row(page, request, reload) {
  const { repetition, iteration, kind, unit, repeats, answers, branch, same_as: same } = request;
  const answer = answers.find(({ state }) => state === "counted") ?? null;
  const words = requestWords(request);
  const { experiment } = page;
  const isHeldUp = isWanted(request) && request.state !== "taken" && isAtRest(experiment.state);
  const state = [ENDED[request.state] ?? stateText(request), isHeldUp ? `, but the experiment is ${experiment.state.toLowerCase()}` : null,
    branch === null ? null : `, in closed branch ${branch}`, same ? ", same controller as before" : null];
  const undo = answer && branch === null ? undoButtons({ answer, repeats, unit, words }, page.signal, reload)
    : isWanted(request) && !isHeldUp ? h("a", { href: `#/bench?experiment=${experiment.id}&request=${request.id}`, "aria-label": `To the bench: ${words}` }, "To the bench") : "";
  return [repetition, iteration, kind, answer ? [answerText(answer), ...history(request)] : history(request),
    answer?.values ? number(answer.fitness) : "–", state, answer?.operator ?? "–", answer ? new Date(answer.at).toLocaleString() : "–",
    replayLink(page, request), undo];
}

/** Return the note and the files of the answer that counts, and the answers that do not. @param {Api.RequestRead} request */
function history({ id, answers, unit }) {
  const notes = answers.filter(({ state, note }) => state === "counted" && note).map(({ note }) => h("li", {}, `Note: ${note}`));
  const others = answers.filter(({ state }) => state !== "counted").map((answer) =>
    h("li", {}, `${answerText(answer, unit)}, by ${answer.operator}: ${HISTORY[answer.state]}${answer.reason ? ` (${answer.reason})` : ""}`));
  const files = answers.filter(({ state }) => state === "counted").flatMap(({ attachments }) => attachments)
    .map((hash, index) => h("li", {}, downloadLink(`File ${index + 1}`, `/attachments/${hash}`, {}, `measurement-${id}-${index + 1}`)));
  const items = [...notes, ...files, ...others];
  const label = [notes.length ? "note" : "", files.length ? `${files.length} ${files.length === 1 ? "file" : "files"}` : "", others.length ? `${others.length} other ${others.length === 1 ? "answer" : "answers"}` : ""].filter(Boolean).join(", ");
  return items.length ? [h("details", { dataset: { id } }, h("summary", {}, label), h("ul", { class: "helps" }, ...items))] : [];
}

/** Return the branches, each with its steps on demand. @param {Page.StudyPage} page */
export function branches(page) {
  const place = h("div");
  page.sections.add(place, REWRITES, async () => {
    /** @type {Api.BranchRead[]} */
    const loaded = await get(`/experiments/${page.experiment.id}/branches`, {}, page.signal);
    refill(place, JSON.stringify(loaded.map(({ repetition, number }) => [repetition, number])), () =>
      (loaded.length ? loaded.map(branch) : empty("No correction has closed a branch.")));
  });
  return [h("p", { class: "note" }, "Steps that followed from a measurement which was corrected or voided. They are in no curve; measurements among them are reused."), place];
}

/** @param {Api.BranchRead} branch */
function branch({ repetition, number, iteration, reason, sentences, closed_at: at }) {
  const title = `Branch ${number} of repetition ${repetition}, from iteration ${iteration}: ${count(sentences.length)} ${sentences.length === 1 ? "step" : "steps"}`;
  return h("details", { class: "branch" },
    h("summary", {}, title, h("span", { class: "note" }, ` ${reason} · closed ${new Date(at).toLocaleString()}`)),
    framed(title, h("ol", { class: "events" }, ...sentences.map((sentence) => h("li", {}, sentence)))));
}
