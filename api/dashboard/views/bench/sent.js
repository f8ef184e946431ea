// @ts-check
/** The answers of this browser: which are stored, and which still wait here. */

import { undoButtons } from "../../lib/bench/corrections.js";
import { answerText } from "../../lib/bench/requests.js";
import { answers } from "../../lib/bench/sender.js";
import { button, h, refill, setText } from "../../lib/dom.js";
import { reviseAnswer } from "./answer_form.js";

/** @typedef {import("../../lib/bench/outbox.js").Entry} Entry */

/** @type {Record<Api.AnswerState, string>} */
const STORED = {
  counted: "stored, and counts", conflict: "stored, in conflict with another answer: a person decides which one counts",
  replaced: "stored, and replaced since", void: "stored, and void since", dismissed: "stored, and dismissed since",
};

/** Return the list, which says first whether anything waits. @param {Page.BenchView} view @returns {Page.Updatable} */
export function sentList(view) {
  const summary = h("p", { class: "large", role: "status" });
  const list = h("div");
  const element = h("section", { class: "card sent", "aria-labelledby": "sent-title", hidden: true }, h("h2", { id: "sent-title" }, "Your answers"), summary, list);
  const update = () => {
    const entries = answers.list().reverse();
    element.hidden = !entries.length;
    setText(summary, summaryOf(entries));
    refill(list, JSON.stringify(entries), () => h("ul", { class: "rows" }, ...entries.map((entry) => row(entry, view))));
  };
  return { element, update };
}

/** Return in a sentence what is stored and what waits. @param {{ state: Entry["state"] }[]} entries */
export function summaryOf(entries) {
  const of = (/** @type {Entry["state"]} */ state) => entries.filter((entry) => entry.state === state).length;
  const [waiting, refused] = [of("waiting"), of("refused")];
  const parts = [
    waiting ? `${waiting} ${waiting === 1 ? "answer waits" : "answers wait"} in this browser until the service has ${waiting === 1 ? "it" : "them"}.` : "",
    refused ? `${refused} ${refused === 1 ? "was" : "were"} refused.` : "",
  ].filter(Boolean);
  return parts.join(" ") || "✓ All of them are stored by the service.";
}

/** @param {Entry} entry @param {Page.BenchView} view */
function row(entry, view) {
  const { key, state, words, body, message, answer } = entry;
  const unit = body.unit ?? "";
  const forget = () => answers.forget(key);
  const revise = () => {
    reviseAnswer(view, entry.request, body);
    forget();
    view.choose(entry.request);
    view.refresh();
  };
  /** @type {Record<Entry["state"], () => Page.Child[]>} */
  const parts = {
    waiting: () => [h("span", { class: "waiting" }, "◌ Waits to be sent", message ? `: ${message}` : "…")],
    refused: () => [h("span", { class: "failed" }, `✕ Refused: ${message}`), h("span", {}, button("Change it", revise), " ", button("Discard it", forget))],
    sent: () => {
      const stored = /** @type {Api.AnswerRead} */ (answer);
      const done = () => {
        forget();
        view.refresh();
      };
      const undo = stored.state === "counted" ? undoButtons({ answer: stored, repeats: entry.repeats, unit, words }, view.signal, done) : null;
      return [h("span", {}, `✓ ${STORED[stored.state]}`), undo];
    },
  };
  return h("li", { class: state, dataset: { key } }, h("strong", {}, answerText(answer ?? body, unit)), h("span", { class: "note" }, ` ${words} · ${new Date(entry.made).toLocaleTimeString([], { hour: "2-digit", minute: "2-digit" })}`), ...parts[state]());
}
