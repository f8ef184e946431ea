/** Questions that are asked in a dialog: what cannot be undone, and what needs more than a press of a button. */

import { h } from "./dom.js";

/**
 * Ask, and do: `act(values)` is called with the fields' values when the reader agrees, and closes the dialog unless it
 * fails; its error stands in the dialog then. Fields are `{ name, label, value, hint, multiline, ...attributes }`.
 */
export function ask({ title, words = "", fields = [], action, danger = false, act }, signal) {
  const trouble = h("div", { class: "failed", role: "alert" });
  const go = h("button", { type: "submit", class: danger ? "danger" : null }, action);
  const back = h("button", { type: "button", class: "quiet", onclick: () => dialog.close() }, "Back");
  const submit = async (event) => {
    event.preventDefault();
    go.disabled = true;
    trouble.replaceChildren();
    try {
      await act(Object.fromEntries(new FormData(form)));
      dialog.close();
    } catch (error) {
      trouble.replaceChildren(...said(error));
    }
    go.disabled = false;
  };
  const form = h("form", { onsubmit: submit }, h("h2", { id: "asked" }, title), words ? h("p", {}, words) : null,
    ...fields.map(labelled), trouble, h("p", { class: "choices" }, go, back));
  const dialog = h("dialog", { "aria-labelledby": "asked", onclose: () => dialog.remove() }, form);
  signal.addEventListener("abort", () => dialog.close());
  document.body.append(dialog);
  dialog.showModal();
  return dialog;
}

function labelled({ name, label, value, hint, multiline = false, ...attributes }) {
  const id = `asked-${name}`;
  const described = hint ? { "aria-describedby": `${id}-hint` } : {};
  const field = h(multiline ? "textarea" : "input", { id, name, ...attributes, ...described });
  field.value = value ?? "";
  return h("p", { class: "field" }, h("label", { for: id }, label), field,
    hint ? h("small", { id: `${id}-hint` }, hint) : null);
}

/** What went wrong, as paragraphs: the problem's words, and a line for each value that it names. */
export function said(error) {
  const places = (error.errors ?? []).map((each) => h("p", {}, h("code", {}, each.pointer || "all of it"), ` ${each.message}`));
  return places.length ? places : [h("p", {}, error.message)];
}
