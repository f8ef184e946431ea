/** Which controller is replayed, and in which simulator. */

import { h } from "../../lib/dom.js";

/** Controls that change what is `asked` and then call `load`. */
export function choices({ spec, strategy }, asked, load) {
  const direct = strategy === "direct";
  const iterations = direct ? [0] : Array.from({ length: (spec.iterations ?? 0) + 1 }, (_, number) => number);
  const kind = select("Controller", [["transfer", "transferred controller"], ...(direct ? [] : [["sample", "real-world sample"]])], asked.kind);
  const repetition = h("input", { type: "number", min: 0, max: spec.repetitions - 1, step: 1, value: asked.repetition, class: "short", "aria-label": "Repetition" });
  const iteration = h("select", { "aria-label": "Iteration" });
  const simulator = direct ? null : select("Simulator", [["", "of its own iteration"], ...iterations.map((each) => [String(each), `of iteration ${each}`])], asked.simulator ?? "");

  /** Samples begin with iteration 1. */
  function offer() {
    const first = kind.value === "sample" ? 1 : 0;
    if (asked.iteration < first) asked.iteration = first;
    iteration.replaceChildren(...iterations.slice(first).map((each) => h("option", { value: each, selected: each === asked.iteration }, each)));
    iteration.value = asked.iteration;
    if (simulator) simulator.options[0].textContent = kind.value === "sample" ? "that selected it" : "that it evolved in";
  }

  offer();
  const changed = () => {
    if (!repetition.reportValidity() || repetition.value === "") return;
    Object.assign(asked, { kind: kind.value, repetition: Number(repetition.value), iteration: Number(iteration.value), simulator: simulator?.value || null });
    offer();
    load();
  };
  return h("p", { class: "options chosen", onchange: changed },
    h("label", {}, "Controller ", kind), h("label", {}, "Repetition ", repetition),
    h("label", {}, "Iteration ", iteration), simulator ? h("label", {}, "Simulator ", simulator) : null);
}

const select = (label, options, chosen) =>
  h("select", { "aria-label": label }, ...options.map(([value, words]) => h("option", { value, selected: String(chosen) === value }, words)));
