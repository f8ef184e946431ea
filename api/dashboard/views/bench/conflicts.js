// @ts-check
/** Conflicts: several answers to one request, of which a person lets one count. */

import { ageOf } from "../../lib/ages.js";
import { byOperator, whatFollows } from "../../lib/bench/corrections.js";
import { answerText, requestWords } from "../../lib/bench/values.js";
import { openDialog } from "../../lib/dialog.js";
import { h } from "../../lib/dom.js";
import { readableName } from "../../lib/format.js";
import { keyed } from "../../lib/keyed.js";

/**
 * Return the conflicts; nothing if there are none.
 *
 * @param {Api.RequestRead[]} requests
 * @param {{ signal: AbortSignal, refresh: () => unknown }} view
 */
export function conflictList(requests, view) {
  if (!requests.length) return null;
  return h("section", { class: "card conflicts", "aria-labelledby": "conflicts-title" }, h("h2", { id: "conflicts-title" }, "Conflicts to decide"),
    h("p", { class: "note" }, "These answers came late, or second. None is lost: decide which one counts."),
    ...requests.map((request) => conflict(request, view)));
}

/**
 * @param {Api.RequestRead} request
 * @param {{ signal: AbortSignal, refresh: () => unknown }} view
 */
function conflict(request, view) {
  const counted = request.answers.find(({ state }) => state === "counted") ?? null;
  const rows = request.answers.filter(({ state }) => state === "counted" || state === "conflict").map((answer) => {
    const error = h("span", { role: "alert", class: "failed" });
    const press = (/** @type {"this" | "other"} */ counts) => async () => {
      error.textContent = "";
      await decide({ request, answer, counted, counts }, view).catch((problem) => { error.textContent = problem.message; });
    };
    const button = (/** @type {string} */ label, /** @type {"this" | "other"} */ counts) =>
      h("button", { type: "button", class: "quiet small", "aria-label": `${label}: ${answerText(answer, request.unit)}, by ${answer.operator}`, onclick: press(counts) }, label);
    return h("li", {}, h("strong", {}, answerText(answer, request.unit)), h("span", { class: "note" }, ` by ${answer.operator}, `, ageOf(answer.at), `${partsOf(answer)}${answer.note ? `: ${answer.note}` : ""}`),
      answer.state === "counted" ? h("span", {}, "✓ counts now") : h("span", {}, button("This one counts…", "this"), " ", button("Dismiss it…", "other")), error);
  });
  return h("div", {}, h("h3", {}, `${readableName(request.robot)}, ${requestWords(request)}`), h("ul", { class: "rows" }, ...rows));
}

/**
 * Return what an answer has beside its values, since answers in conflict may differ in that alone.
 *
 * @param {Api.AnswerRead} answer
 */
const partsOf = ({ readings, attachments: { length } }) => `${readings ? ", with readings" : ""}${length ? `, with ${length} ${length === 1 ? "file" : "files"}` : ""}`;

/**
 * Ask why, and say first what follows.
 *
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
    fields: [{ name: "reason", label: "Why?", value: "", required: true, maxlength: 2000, autocomplete: "off", hint: "it is stored with the answer" }],
    action: counts === "this" ? "Let it count" : "Dismiss it",
    act: async ({ reason }) => {
      await send({ counts, reason, ...byOperator() });
      view.refresh();
    },
  }, view.signal);
}
