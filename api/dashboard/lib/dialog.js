// @ts-check
/** Dialogs for what cannot be undone, and for what needs more than a press of a button. */

import { h } from "./dom.js";

/**
 * @typedef {{ name: string, label: string, value: unknown, hint?: string, multiline?: boolean, [attribute: string]: unknown }} Field
 * @typedef {object} Question
 * @property {string} title
 * @property {string} [text]
 * @property {Field[]} [fields]
 * @property {string} action the label of the button that agrees
 * @property {boolean} [danger] whether the action loses something
 * @property {(values: Record<string, any>) => Promise<void>} act called with the values of the fields when the reader agrees
 */

/**
 * Open a dialog until `act` succeeds or the reader goes back; an error of `act` is shown in it.
 * @param {Question} question
 * @param {AbortSignal} signal
 */
export function openDialog({ title, text = "", fields = [], action, danger = false, act }, signal) {
  const errors = h("div", { class: "failed", role: "alert" });
  const agree = h("button", { type: "submit", class: danger ? "danger" : null }, action);
  const back = h("button", { type: "button", class: "quiet", onclick: () => { dialog.close(); } }, "Back");
  const submit = async (/** @type {SubmitEvent} */ event) => {
    event.preventDefault();
    agree.disabled = true;
    errors.replaceChildren();
    try {
      await act(Object.fromEntries(new FormData(form)));
      dialog.close();
    } catch (error) {
      errors.replaceChildren(...errorParagraphs(error));
    }
    agree.disabled = false;
  };
  const form = h("form", { onsubmit: submit }, h("h2", {}, title), text ? h("p", {}, text) : null,
    ...fields.map(labelledField), errors, h("p", { class: "choices" }, agree, back));
  const dialog = h("dialog", { "aria-label": title, onclose: () => { dialog.remove(); } }, form);
  signal.addEventListener("abort", () => dialog.close());
  document.body.append(dialog);
  dialog.showModal();
  return dialog;
}

/** @param {Field} field */
function labelledField({ name, label, value, hint, multiline = false, ...attributes }) {
  const id = `asked-${name}`;
  const described = hint ? { "aria-describedby": `${id}-hint` } : {};
  const field = h(multiline ? "textarea" : "input", { id, name, ...attributes, ...described });
  field.value = String(value ?? "");
  return h("p", { class: "field" }, h("label", { for: id }, label), field,
    hint ? h("small", { id: `${id}-hint` }, hint) : null);
}

/** Return an error as paragraphs: one for each value that it names, else its message. @param {any} error */
export function errorParagraphs(error) {
  const named = /** @type {Api.SpecError[]} */ (error.errors ?? []);
  const lines = named.map(({ pointer, message }) => h("p", {}, h("code", {}, pointer || "the whole request"), ` ${message}`));
  return lines.length ? lines : [h("p", {}, error.message)];
}

/**
 * Send a request; if the service wants it confirmed, ask the reader, and send it again.
 *
 * @template T
 * @param {(query: string) => Promise<T>} send adds a query to the address
 * @param {AbortSignal} signal
 * @returns {Promise<T | null>} the answer; null if the reader went back
 */
export async function confirmingCost(send, signal) {
  try {
    return await send("");
  } catch (error) {
    const refused = /** @type {Api.SpecError[]} */ (error.errors ?? []).find(({ pointer }) => pointer === "confirm_cost");
    if (!refused) throw error;
    return new Promise((resolve) => {
      const dialog = openDialog({
        title: "Is that right?", text: `The service says: ${refused.message}.`, action: "Do it all the same",
        act: async () => { resolve(await send("?confirm_cost=true")); },
      }, signal);
      dialog.addEventListener("close", () => { resolve(null); });  // after an answer, this does nothing
    });
  }
}
