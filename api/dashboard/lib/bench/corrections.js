// @ts-check
/** Dialogs that correct or void a measurement, or decide a conflict of answers; each first says what follows. */

import { keyed, post, Problem } from "../api.js";
import { openDialog } from "../dialog.js";
import { button, h, tellingErrors } from "../dom.js";
import { readableName } from "../format.js";
import { ageOf } from "../live.js";
import { browserStore } from "./outbox.js";
import { answerText, requestWords, typedValues } from "./requests.js";

/**
 * @typedef {object} Measurement a measurement that counts
 * @property {Api.AnswerRead} answer
 * @property {number} repeats
 * @property {string} unit
 * @property {string} words which one it is
 */

export const REASON = { name: "reason", label: "Why?", value: "", required: true, maxlength: 2000, autocomplete: "off", hint: "it is stored with the measurement" };

/** The name of the person at this browser. */
export const operatorName = () => /** @type {string} */ (browserStore("operator").read("name") ?? "");

/**
 * Return buttons that correct and void a measurement, with room for an error.
 * @param {Measurement} measurement
 * @param {AbortSignal} signal
 * @param {() => unknown} done called after a change
 */
export function undoButtons(measurement, signal, done) {
  const error = h("span", { role: "alert", class: "failed" });
  const undo = (/** @type {string} */ label, /** @type {typeof correct} */ open) =>
    button(label, tellingErrors(error)(() => open(measurement, signal, done)), { "aria-label": `${label} ${measurement.words}` });
  return h("span", { class: "undo" }, undo("Correct…", correct), " ", undo("Void…", voidIt), error);
}

/** Ask for the right values. @param {Measurement} measurement @param {AbortSignal} signal @param {() => unknown} done */
async function correct({ answer, repeats, unit, words }, signal, done) {
  const path = `/measurements/${answer.id}/corrections`;
  const now = answer.values ? { values: answer.values } : { failed: answer.failed };
  const follows = await whatFollows(path, now);
  const before = Array.from({ length: repeats }, (_, index) => String(answer.values?.[index] ?? ""));
  const fields = before.map((value, index) => ({
    name: `value_${index + 1}`, label: repeats > 1 ? `Repeat ${index + 1}${unit && ` (${unit})`}` : `Value${unit && ` (${unit})`}`,
    value, inputmode: "decimal", autocomplete: "off",
  }));
  const why = { name: "failed", label: "Or why it failed", value: "", hint: answer.failed ? `now: ${answer.failed}` : "", maxlength: 2000, autocomplete: "off" };
  const send = keyed(path);
  openDialog({
    title: "Correct this measurement",
    text: `${capital(words)}: ${answerText(answer, unit)}. If it is corrected: ${follows}.${answer.readings ? " Its readings are dropped." : ""}`,
    fields: [...fields, why, REASON],
    action: "Correct it",
    act: async (given) => {
      await send({ ...correctionOf(given, before), ...(unit && !given.failed.trim() ? { unit } : {}), reason: given.reason, ...byOperator() });
      done();
    },
  }, signal);
}

/**
 * Return the body of a correction from the fields of its dialog: values, or a reason.
 * @param {Record<string, string>} given
 * @param {string[]} before the values that the fields had at first, one for each repeat
 */
export function correctionOf(given, before) {
  const texts = before.map((_, index) => given[`value_${index + 1}`]);
  const failed = given.failed.trim();
  const isTyped = texts.some((text, index) => text.trim() && text !== before[index]);
  if (failed && isTyped) throw new Problem({ title: "Values and a reason", detail: "A measurement has values, or a reason why it failed. Clear one of them." });
  if (failed) return { failed };
  const { values, mistakes } = typedValues(texts);
  const told = mistakes.flatMap((mistake, index) => (mistake ? [`Repeat ${index + 1}: ${mistake}.`] : []));
  if (told.length) throw new Problem({ title: "Not all values are numbers", detail: told.join(" ") });
  return { values };
}

/** Ask why a measurement is worth nothing. @param {Measurement} measurement @param {AbortSignal} signal @param {() => unknown} done */
async function voidIt({ answer, unit, words }, signal, done) {
  const path = `/measurements/${answer.id}/void`;
  const follows = await whatFollows(path, {});
  const send = keyed(path);
  openDialog({
    title: "Void this measurement?",
    text: `${capital(words)}: ${answerText(answer, unit)}. If it is void: ${follows}.`,
    fields: [REASON], action: "Void it", danger: true,
    act: async ({ reason }) => {
      await send({ reason, ...byOperator() });
      done();
    },
  }, signal);
}

/**
 * Return what would follow from a change, in the service's words.
 * @param {string} path
 * @param {Record<string, unknown>} body
 * @returns {Promise<string>}
 */
export const whatFollows = async (path, body) => (await post(`${path}?dry_run=true`, { ...body, reason: "dry run" })).words;

/** Return the part of a body that says who did it. */
export const byOperator = () => (operatorName() ? { operator: operatorName() } : {});

/** @param {string} words */
const capital = (words) => words[0].toUpperCase() + words.slice(1);

/**
 * Return the conflicts; nothing if there are none.
 * @param {Api.RequestRead[]} requests
 * @param {{ signal: AbortSignal, refresh: () => unknown }} view
 */
export function conflictList(requests, view) {
  if (!requests.length) return null;
  return h("section", { class: "card conflicts", "aria-labelledby": "conflicts-title" }, h("h2", { id: "conflicts-title" }, "Conflicts to decide"),
    h("p", { class: "note" }, "These answers came late, or second. None is lost: decide which one counts."),
    ...requests.map((request) => conflict(request, view)));
}

/** @param {Api.RequestRead} request @param {{ signal: AbortSignal, refresh: () => unknown }} view */
function conflict(request, view) {
  const counted = request.answers.find(({ state }) => state === "counted") ?? null;
  const rows = request.answers.filter(({ state }) => state === "counted" || state === "conflict").map((answer) => {
    const error = h("span", { role: "alert", class: "failed" });
    const choose = (/** @type {string} */ label, /** @type {"this" | "other"} */ counts) =>
      button(label, tellingErrors(error)(() => decide({ request, answer, counted, counts }, view)), { "aria-label": `${label}: ${answerText(answer, request.unit)}, by ${answer.operator}` });
    return h("li", {}, h("strong", {}, answerText(answer, request.unit)), h("span", { class: "note" }, ` by ${answer.operator}, `, ageOf(answer.at), `${partsOf(answer)}${answer.note ? `: ${answer.note}` : ""}`),
      answer.state === "counted" ? h("span", {}, "✓ counts now") : h("span", {}, choose("This one counts…", "this"), " ", choose("Dismiss it…", "other")), error);
  });
  return h("div", {}, h("h3", {}, `${readableName(request.robot)}, ${requestWords(request)}`), h("ul", { class: "rows" }, ...rows));
}

/** Return what an answer has beside its values, since answers in conflict may differ in that alone. @param {Api.AnswerRead} answer */
const partsOf = ({ readings, attachments: { length } }) => `${readings ? ", with readings" : ""}${length ? `, with ${length} ${length === 1 ? "file" : "files"}` : ""}`;

/**
 * Ask why, and say first what follows.
 * @param {{ request: Api.RequestRead, answer: Api.AnswerRead, counted: Api.AnswerRead | null, counts: "this" | "other" }} choice
 * @param {{ signal: AbortSignal, refresh: () => unknown }} view
 */
async function decide({ request, answer, counted, counts }, view) {
  const given = answer.values ? { values: answer.values } : { failed: answer.failed };
  const follows = counts === "other" ? "what counts now still counts"
    : counted ? await whatFollows(`/measurements/${counted.id}/corrections`, given) : "the repetition goes on with it";
  const send = keyed(`/measurements/${answer.id}/decision`);
  openDialog({
    title: counts === "this" ? "Let this answer count?" : "Dismiss this answer?",
    text: `${answerText(answer, request.unit)} by ${answer.operator}. ${counts === "this" ? "If it counts" : "If it is dismissed"}: ${follows}.`,
    fields: [REASON],
    action: counts === "this" ? "Let it count" : "Dismiss it",
    act: async ({ reason }) => {
      await send({ counts, reason, ...byOperator() });
      view.refresh();
    },
  }, view.signal);
}
