// @ts-check
/** The form for an answer: a number for each repeat, or why there are none. What is typed is kept until it is sent. */

import { post, postFile } from "../../lib/api.js";
import { operatorName } from "../../lib/bench/corrections.js";
import { browserStore } from "../../lib/bench/outbox.js";
import { answerText, isMine, requestWords, typedValues, withOtherSign } from "../../lib/bench/requests.js";
import { answers } from "../../lib/bench/sender.js";
import { h, setText } from "../../lib/dom.js";
import { readableName } from "../../lib/format.js";

const ASK_MS = 5000;
const EVALUATE_MS = 600_000;

/** @typedef {{ id: string, name: string }} Kept a stored file */
/** @typedef {{ values: string[], note: string, failed: string, files?: Kept[], traces?: Kept[] }} Draft */

/**
 * Return the form. A request keeps its form when its card is made again, so that nobody who types is interrupted.
 * @param {Api.RequestRead} request
 * @param {Page.BenchView} view
 */
export function answerForm(request, view) {
  if (view.form?.id !== request.id) view.form = { id: request.id, element: make(request, view) };
  return view.form.element;
}

/** Fill the form of a request with an answer that was refused. @param {Page.BenchView} view @param {string} id @param {Record<string, any>} body */
export function reviseAnswer(view, id, { values, note, failed, attachments = [], traces = [] }) {
  const [files, recorded] = [attachments, traces].map((hashes) => hashes.map((/** @type {string} */ hash) => ({ id: hash, name: "file" })));
  browserStore("draft").write(id, { values: (values ?? []).map(String), note: note ?? "", failed: failed ?? "", files, traces: recorded });
  view.form = null;
}

/** @param {Api.RequestRead} request @param {Page.BenchView} view */
function make(request, view) {
  const { id, repeats, unit, between_repeats: between } = request;
  const drafts = browserStore("draft");
  const draft = /** @type {Draft} */ (drafts.read(id) ?? { values: [], note: "", failed: "" });
  const fields = Array.from({ length: repeats }, (_, index) => valueField(index, repeats, unit, draft.values[index] ?? ""));
  const note = h("textarea", { id: "note", rows: 2, maxlength: 20000 });
  const why = h("input", { id: "failed", maxlength: 2000, autocomplete: "off" });
  Object.assign(note, { value: draft.note });
  Object.assign(why, { value: draft.failed });
  const [trouble, doubt] = [h("p", { class: "failed", role: "alert" }), h("p", { class: "failed", role: "alert" })];
  const keep = () => drafts.write(id, { values: fields.map(({ input }) => input.value), note: note.value, failed: why.value, files: files.kept(), traces: traces.kept() });
  const files = filesField({ id: "files", label: "Photos and other files" }, draft.files ?? [], keep);
  const traces = filesField({ id: "traces", label: `Traces (CSV) in place of ${repeats === 1 ? "the value" : "values: one for each repeat, in order"}` }, draft.traces ?? [], keep);

  /** @param {Record<string, unknown>} answer */
  function give(answer) {
    const { holding } = view.take;
    const now = view.requests.find((other) => other.id === id) ?? request;
    const take = holding && isMine(now, holding) ? { take: holding.take, operator: holding.operator } : {};
    const by = operatorName() ? { operator: operatorName() } : {};
    answers.add({
      request: id, words: `${readableName(request.robot)}, ${requestWords(request)}`, repeats,
      body: { ...by, ...take, ...answer, ...(unit ? { unit } : {}), ...(note.value.trim() ? { note: note.value.trim() } : {}),
        ...(files.kept().length ? { attachments: files.kept().map((file) => file.id) } : {}) },
    });
    drafts.remove(id);
    view.form = null;
    view.answered(id);
  }

  let asked = "";
  const submit = async (/** @type {SubmitEvent} */ event) => {
    event.preventDefault();
    const recorded = traces.kept().map((file) => file.id);
    const { values, mistakes } = recorded.length ? { values: [], mistakes: [] } : typedValues(fields.map(({ input }) => input.value));
    fields.forEach((field, index) => field.mark(mistakes[index] ?? null));
    const first = mistakes.findIndex(Boolean);
    if (first >= 0) {
      fields[first].input.focus();
      return;
    }
    const measured = recorded.length ? { traces: recorded } : { values };
    const isConfirmed = asked === JSON.stringify(measured);
    setText(doubt, recorded.length ? "Evaluating the traces…" : "");
    const doubts = isConfirmed ? [] : await doubtsAbout(id, measured, unit);
    asked = JSON.stringify(measured);
    setText(doubt, doubts.length ? `${doubts.join("; ")}. Send ${recorded.length ? "the traces" : "it all the same"}?` : "");
    if (!doubts.length) give({ ...measured, ...(isConfirmed ? { confirmed: true } : {}) });
  };
  const fail = () => {
    setText(trouble, why.value.trim() ? "" : "Enter why it failed.");
    if (why.value.trim()) give({ failed: why.value.trim() });
    else why.focus();
  };
  why.addEventListener("keydown", (event) => {
    if (event.key !== "Enter") return;
    event.preventDefault();  // Enter would send the values
    fail();
  });
  return h("form", { class: "answer", novalidate: true, oninput: keep, onsubmit: submit },
    ...fields.map(({ element }) => element),
    between ? traces.element : null, h("p", { class: "field" }, h("label", { for: "note" }, "Note"), note), files.element,
    doubt, h("button", { type: "submit", class: "big" }, repeats === 1 ? "Send the value" : `Send ${repeats} values`),
    h("details", { open: Boolean(draft.failed) }, h("summary", {}, "It failed…"),
      h("p", { class: "field" }, h("label", { for: "failed" }, "Why?"), why,
        h("small", {}, "The controller counts as tried, but simulators are not tuned on it. If the measurement itself was wrong, measure again instead.")),
      trouble, h("button", { type: "button", class: "quiet", onclick: fail }, "Send that it failed")));
}

/**
 * Return what is unlikely about values, and what traces say; nothing if the service is away. It then remarks on what it gets later.
 * @param {string} id
 * @param {{ values?: number[], traces?: string[] }} measured
 * @param {string} unit
 * @returns {Promise<string[]>}
 */
async function doubtsAbout(id, measured, unit) {
  try {
    if (!measured.traces) return (await post(`/requests/${id}/doubts`, measured, {}, AbortSignal.timeout(ASK_MS))).doubts;
    const { values, doubts } = await post(`/requests/${id}/traces`, measured, {}, AbortSignal.timeout(EVALUATE_MS));
    return [answerText({ values }, unit), ...doubts];
  } catch (error) {
    return measured.traces && error.status ? [error.message] : [];
  }
}

/**
 * @param {number} index
 * @param {number} repeats
 * @param {string} unit
 * @param {string} value
 */
function valueField(index, repeats, unit, value) {
  const id = `value-${index + 1}`;
  const input = h("input", { id, inputmode: "decimal", autocomplete: "off", "aria-describedby": `${id}-mistake`, enterkeyhint: index + 1 < repeats ? "next" : "send" });
  input.value = value;
  const room = h("span", { class: "trouble", id: `${id}-mistake`, "aria-live": "polite" });
  const label = `${repeats === 1 ? "Value" : `Repeat ${index + 1}`}${unit ? ` (${unit})` : ""}`;
  const mark = (/** @type {string | null} */ mistake) => {
    setText(room, mistake ?? "");
    if (mistake) input.setAttribute("aria-invalid", "true");
    else input.removeAttribute("aria-invalid");
  };
  const changeSign = () => {
    input.value = withOtherSign(input.value);
    input.dispatchEvent(new Event("input", { bubbles: true }));
    input.focus();
  };
  const sign = h("button", { type: "button", class: "quiet", "aria-label": `Change the sign of ${label}`, onclick: changeSign }, "±");
  return { input, mark, element: h("div", { class: "field value" }, h("label", { for: id }, label), h("div", {}, input, sign), room) };
}

/**
 * Return a field for files of an answer, like photographs, or its traces, and the files that it has. Each is stored as soon as it is
 * chosen, and the answer names it by its hash.
 * @param {{ id: string, label: string }} words
 * @param {Kept[]} given
 * @param {() => void} changed
 */
function filesField({ id: name, label }, given, changed) {
  let kept = given;
  const input = h("input", { id: name, type: "file", multiple: true });
  const list = h("ul", { class: "rows" });
  const status = h("small", { role: "status" });
  const draw = () => list.replaceChildren(...kept.map((file) => {
    const remove = () => {
      kept = kept.filter((other) => other !== file);
      changed();
      draw();
    };
    return h("li", {}, h("span", {}, `✓ ${file.name} `, h("button", { type: "button", class: "link", "aria-label": `Remove ${file.name}`, onclick: remove }, "Remove")));
  }));
  input.addEventListener("change", async () => {
    for (const file of input.files ?? []) {
      setText(status, `Sending ${file.name}…`);
      try {
        const { id } = await postFile("/attachments", { name: file.name.slice(0, 200) }, file, file.type || "application/octet-stream");
        kept = [...kept.filter((other) => other.id !== id), { id, name: file.name }];
        setText(status, "");
      } catch (error) {
        setText(status, `${file.name} is not stored: ${error.message} Choose it again.`);
      }
      changed();
      draw();
    }
    input.value = "";
  });
  draw();
  const element = h("div", { class: "field" }, h("label", { for: name }, label), input, status, list);
  return { element, kept: () => kept };
}
