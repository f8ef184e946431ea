// @ts-check
/** A new study: a form made from the catalogue, which the service checks and prices while the reader types. */

import { get, keyed, post } from "../lib/api.js";
import { confirmingCost } from "../lib/dialog.js";
import { h } from "../lib/dom.js";
import { parse } from "../lib/json.js";
import { draftOf, followRobot, specOf } from "./new/draft.js";
import { ErrorPlaces } from "./new/fields.js";
import { robotStep, searchStep, sizeStep } from "./new/form_parts.js";
import { panel } from "./new/panel.js";

const TYPING_MS = 300;
const STEPS = [robotStep, searchStep, sizeStep];

/** @typedef {Record<string, any>} Spec */
/** @typedef {{ name: string, summary: string, spec: Record<string, any> }} Preset */

/**
 * Fill `root` with the form, until `signal`. A spec in the address fills the form.
 * @param {HTMLElement} root
 * @param {URLSearchParams} parameters
 * @param {AbortSignal} signal
 */
export async function show(root, parameters, signal) {
  /** @type {[Api.Catalogue, Preset[]]} */
  const [catalogue, presets] = await Promise.all([get("/catalogue", {}, signal), get("/assets/dashboard/presets.json", {}, signal)]);
  const form = new Form(catalogue, presets[0].spec, signal);
  const starts = presets.map(({ name, summary, spec }) =>
    h("button", { type: "button", class: "quiet", title: summary, onclick: () => form.start(spec) }, name));
  const paste = pasteField((spec) => { form.start(spec); });
  const [note, given] = [parameters.get("note"), parameters.get("spec")];
  if (given === null || !await paste.take(given)) form.remake();
  if (signal.aborted) return;
  root.replaceChildren(h("h1", {}, "New study"), ...(note ? [h("p", { class: "remark" }, note)] : []),
    h("div", { class: "starts", role: "group", "aria-label": "Start from" }, h("span", { class: "note" }, "Start from"), ...starts), paste.element, form.element);
}

/** The form, its content, and what the service says about it. */
export class Form {
  /** @param {Api.Catalogue} catalogue @param {Record<string, any>} spec the one to start from @param {AbortSignal} signal */
  constructor(catalogue, spec, signal) {
    this.catalogue = catalogue;
    this.signal = signal;
    this.draft = draftOf(spec, catalogue);
    this.places = new ErrorPlaces();
    /** @type {number | undefined} */
    this.timer = undefined;
    this.requests = 0;
    this.isRefused = false;
    this.send = keyed("/studies");
    this.panel = panel();
    this.parts = h("div", { class: "parts" });
    this.element = h("form", { class: "new", novalidate: true, onsubmit: (event) => { this.submit(event); } }, this.parts, this.panel.element);
    this.changed = () => this.check();
    signal.addEventListener("abort", () => clearTimeout(this.timer));
  }

  /** Return a function that sets a value of the draft. @param {Record<string, any>} object @param {string} name */
  setter(object, name) {
    return (/** @type {unknown} */ value) => {
      object[name] = value;
      this.changed();
    };
  }

  /** Start from another spec. @param {Record<string, any>} spec */
  start(spec) {
    this.draft = draftOf(spec, this.catalogue);
    this.remake();
  }

  /** Make all fields again, since a choice adds or removes some; the focus stays, and so do unfolded parts. */
  remake() {
    const inputs = () => /** @type {HTMLElement[]} */ ([...this.parts.querySelectorAll("input, select, summary, button")]);
    const details = () => [...this.parts.querySelectorAll("details")];
    const before = inputs();
    const focused = before.findIndex((input) => input === document.activeElement);
    const label = wordsOf(before[focused]);
    const isOpen = new Map(details().map(({ dataset, open }) => [dataset.id, open]));
    followRobot(this.draft, this.catalogue);
    this.parts.replaceChildren(...STEPS.map((make) => make(this)));
    for (const element of details()) element.open = isOpen.get(element.dataset.id) || element.open;
    const after = inputs();
    if (focused >= 0) (wordsOf(after[focused]) === label ? after[focused] : after.find((input) => wordsOf(input) === label))?.focus();
    this.check(0);
  }

  /** Ask the service soon what the spec costs, and what is wrong with it. */
  check(afterMs = TYPING_MS) {
    this.isRefused = false;
    this.panel.showSpec(specOf(this.draft));
    clearTimeout(this.timer);
    this.timer = setTimeout(() => this.estimate(), afterMs);
  }

  /** Show the cost or the errors of the spec. The errors of a refused submission stay until something is changed. */
  async estimate() {
    const request = ++this.requests;
    const isReplaced = () => request !== this.requests || this.signal.aborted;
    try {
      const estimate = await post("/studies/estimate", specOf(this.draft));
      if (isReplaced()) return;
      this.panel.showCost(estimate);
      if (this.isRefused) return;
      this.places.show([]);
      this.panel.showErrors([]);
    } catch (error) {
      if (!isReplaced() && !this.isRefused) this.showErrors(error, "The cost is shown once the marked fields are right.");
    }
  }

  /** @param {any} error @param {string} words */
  showErrors(error, words) {
    const errors = error.errors ?? [];
    const others = this.places.show(errors);
    this.panel.showErrors(errors.length ? others : [{ pointer: error.title, message: error.message }], errors.length ? words : null);
  }

  /** @param {SubmitEvent} event */
  async submit(event) {
    event.preventDefault();
    const spec = specOf(this.draft);
    this.panel.setBusy(true);
    try {
      const study = await confirmingCost((query) => this.send(spec, query), this.signal);
      if (study) location.hash = `#/studies/${study.id}`;
      else this.panel.setBusy(false);
    } catch (error) {
      if (this.signal.aborted) return;
      this.isRefused = true;
      this.showErrors(error, "The study was not submitted: the marked fields are not right yet.");
      /** @type {HTMLElement | null} */ (this.parts.querySelector("[aria-invalid]"))?.focus();
      this.panel.setBusy(false);
    }
  }
}

/** Return what a field or a button is called. @param {Element | undefined} input */
const wordsOf = (input) => (input instanceof HTMLInputElement || input instanceof HTMLSelectElement ? input.labels?.[0]?.textContent : input?.textContent);

/** Return the spec of a study for a spec of a study or an experiment, whose one strategy becomes a list. @param {Spec} spec @returns {Spec} */
export function studyOf(spec) {
  if (!("strategy" in spec) || "strategies" in spec) return spec;
  const { strategy, ...others } = spec;
  return { ...others, strategies: [strategy] };
}

/** Return the object in a text of JSON. @param {string} text @returns {Spec} */
export function specIn(text) {
  let found;
  try {
    found = parse(text);
  } catch (error) {
    throw new Error(`This is not JSON: ${error.message}`, { cause: error });
  }
  if (found === null || typeof found !== "object" || Array.isArray(found)) throw new Error('A spec is an object, like {"budget": "smoke"}.');
  return found;
}

/**
 * Return a field for pasted JSON, and a function that takes a text as if it had been pasted, and returns whether it is a spec.
 * @param {(spec: Spec) => void} fill fills the form
 */
function pasteField(fill) {
  const area = h("textarea", { id: "pasted", rows: 8, spellcheck: "false", placeholder: '{"budget": "smoke", "repetitions": 3}' });
  const troubles = h("div", { role: "alert", class: "trouble" });
  const element = h("details", { class: "paste" }, h("summary", {}, "Paste a spec"),
    h("label", { for: "pasted" }, "Spec of a study or an experiment, as JSON"), area, troubles,
    h("button", { type: "button", onclick: () => { take(area.value); } }, "Fill the form"));
  const take = async (/** @type {string} */ text) => {
    area.value = text;
    troubles.replaceChildren();
    try {
      const spec = studyOf(specIn(text));
      await post("/studies/estimate", spec);
      fill(spec);
      element.open = false;
      return true;
    } catch (error) {
      element.open = true;
      const errors = error.errors?.length ? error.errors : [{ pointer: "", message: error.message }];
      troubles.replaceChildren(...errors.map((/** @type {{ pointer: string, message: string }} */ { pointer, message }) =>
        h("p", {}, pointer ? h("code", {}, pointer) : null, ` ${message}`)));
      return false;
    }
  };
  return { element, take };
}
