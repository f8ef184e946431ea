// @ts-check
/** Which controller is replayed, and in which simulator. */

import { h } from "../../lib/dom.js";

/**
 * Return controls that change the choice in place, and then call `load`.
 *
 * @param {Api.ExperimentRead} experiment
 * @param {Page.ReplayChoice} choice
 * @param {() => void} load
 */
export function choices({ direct, level, spec }, choice, load) {
  const iterations = level ? [0] : Array.from({ length: spec.iterations + 1 }, (_, number) => number);
  const kinds = [["transfer", "transferred controller"], ...(iterations.length < 2 ? [] : [["sample", "real-world sample"]])];
  const kind = select("Controller", kinds, choice.kind);
  const repetition = h("input", { type: "number", min: 0, max: spec.repetitions - 1, step: 1, value: choice.repetition, class: "short", "aria-label": "Repetition" });
  const iteration = h("select", { "aria-label": "Iteration" });
  const simulators = [["", ""], ...iterations.map((number) => [String(number), `of iteration ${number}`])];
  const simulator = direct ? null : select("Simulator", simulators, String(choice.simulator ?? ""));

  /** Offer the iterations of the kind of controller: samples begin with iteration 1. */
  function offerIterations() {
    const isSample = kind.value === "sample";
    const first = isSample ? 1 : 0;
    choice.iteration = Math.max(choice.iteration, first);
    iteration.replaceChildren(...iterations.slice(first).map((number) => h("option", { value: number, selected: number === choice.iteration }, number)));
    iteration.value = String(choice.iteration);
    if (simulator) simulator.options[0].textContent = isSample ? "that selected it" : "that it evolved in";
  }

  offerIterations();
  const changed = () => {
    if (!repetition.reportValidity() || repetition.value === "") return;
    Object.assign(choice, {
      kind: kind.value, repetition: Number(repetition.value), iteration: Number(iteration.value), simulator: simulator?.value || null });
    offerIterations();
    load();
  };
  return h("p", { class: "options chosen", onchange: changed },
    h("label", {}, "Controller ", kind), h("label", {}, "Repetition ", repetition),
    h("label", {}, "Iteration ", iteration), simulator ? h("label", {}, "Simulator ", simulator) : null);
}

/**
 * @param {string} label
 * @param {string[][]} options
 * @param {string} chosen
 */
const select = (label, options, chosen) =>
  h("select", { "aria-label": label }, ...options.map(([value, words]) => h("option", { value, selected: chosen === value }, words)));
