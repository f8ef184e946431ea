/** A new study: a form made from the catalogue, checked by the service while one types, with what it costs. */

import { get, post } from "../lib/api.js";
import { h } from "../lib/dom.js";
import { written } from "../lib/json.js";
import { draftOf, specOf } from "./new/draft.js";
import { Places } from "./new/fields.js";
import { panel } from "./new/panel.js";
import { budget, extent, reality, simulation, strategies, tunables } from "./new/parts.js";

const TYPING_MS = 300;

/** Fill `root` with the form, until `signal`. */
export async function show(root, parameters, signal) {
  const [catalogue, presets] = await Promise.all([get("/catalogue", {}, signal), get("/assets/dashboard/presets.json", {}, signal)]);
  const form = new Form(catalogue, signal);
  const starts = presets.map(({ name, summary, spec }) =>
    h("button", { type: "button", class: "quiet", title: summary, onclick: () => form.start(spec) }, name));
  root.replaceChildren(h("h1", {}, "New study"),
    h("div", { class: "starts", role: "group", "aria-label": "Start from" }, h("span", { class: "note" }, "Start from"), ...starts), form.element);
  form.start(presets[0].spec);
}

/** The form, its draft, and what the service says of it. */
class Form {
  constructor(catalogue, signal) {
    Object.assign(this, { catalogue, signal, draft: null, places: new Places(), timer: null, turn: 0, refused: false, key: null, keyOf: null });
    this.panel = panel();
    this.parts = h("div", { class: "parts" });
    this.element = h("form", { class: "new", novalidate: true, onsubmit: (event) => this.submit(event) }, this.parts, this.panel.element);
    this.changed = () => this.check();
    signal.addEventListener("abort", () => clearTimeout(this.timer));
  }

  /** A function that sets a value of the draft. */
  set(object, name) {
    return (value) => {
      object[name] = value;
      this.changed();
    };
  }

  /** Begin with another spec. */
  start(spec) {
    this.draft = draftOf(spec, this.catalogue);
    this.remake();
  }

  /** Make the fields anew, for there are others now; what had the focus has it again. */
  remake() {
    const inputs = () => [...this.parts.querySelectorAll("input, select, summary, button")];
    const at = inputs().indexOf(document.activeElement);
    const isOpen = [...this.parts.querySelectorAll("details")].map((each) => each.open);
    this.parts.replaceChildren(...[extent, strategies, simulation, tunables, reality, budget].map((each) => each(this)));
    if (at >= 0) inputs()[at]?.focus();
    const details = [...this.parts.querySelectorAll("details")];
    if (details.length === isOpen.length) details.forEach((each, number) => { each.open ||= isOpen[number]; });
    this.check(0);
  }

  /** Ask the service what the spec costs and what is wrong with it, soon. */
  check(after = TYPING_MS) {
    this.refused = false;
    this.panel.show(specOf(this.draft));
    clearTimeout(this.timer);
    this.timer = setTimeout(() => this.estimate(), after);
  }

  /** What was said of a submission that was refused stays until something is changed. */
  async estimate() {
    const turn = ++this.turn;
    const overtaken = () => turn !== this.turn || this.signal.aborted;
    try {
      const found = await post("/studies/estimate", specOf(this.draft));
      if (overtaken()) return;
      this.panel.estimate(found);
      if (this.refused) return;
      this.places.show([]);
      this.panel.refuse([]);
    } catch (error) {
      if (!overtaken() && !this.refused) this.refuse(error, "Once what is marked is right, this says what it costs.");
    }
  }

  refuse(error, words) {
    const errors = error.errors ?? [];
    const others = this.places.show(errors);
    this.panel.refuse(errors.length ? others : [{ pointer: error.title, message: error.message }], errors.length ? words : null);
  }

  async submit(event) {
    event.preventDefault();
    const spec = specOf(this.draft);
    this.panel.busy(true);
    try {
      const study = await post("/studies", spec, { "Idempotency-Key": this.keyFor(written(spec)) });
      location.hash = `#/studies/${study.id}`;
    } catch (error) {
      if (this.signal.aborted) return;
      this.refused = true;
      this.refuse(error, "It was not submitted: what is marked is not right yet.");
      this.parts.querySelector("[aria-invalid]")?.focus();
      this.panel.busy(false);
    }
  }

  /** The same key for the same spec: pressed again after no answer came, it is submitted once. */
  keyFor(text) {
    const random = () => Array.from(crypto.getRandomValues(new Uint32Array(4)), (each) => each.toString(16)).join("-");
    if (this.keyOf !== text) Object.assign(this, { keyOf: text, key: random() });
    return this.key;
  }
}
