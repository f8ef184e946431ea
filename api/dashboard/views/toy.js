/** The toy of the paper's Fig. 3, stepped through: truth, tuned approximations, samples and transfer, by iteration. */

import { get, search } from "../lib/api.js";
import { h } from "../lib/dom.js";
import { figureFiles } from "../lib/downloads.js";
import { plot } from "../lib/plot.js";
import { empty } from "../lib/states.js";

const STEP_MS = 1300;

/** Fill `root` with the iterations of one repetition of the experiment that `parameters` name, until `signal`. */
export async function show(root, parameters, signal) {
  const id = parameters.get("experiment");
  if (!id) {
    const make = h("a", { href: "#/new", class: "button" }, "New study");
    root.replaceChildren(h("h1", {}, "The toy function"), empty("It is stepped through from the page of an experiment with the robot toy_function.", make));
    return;
  }
  const experiment = await get(`/experiments/${id}`, {}, signal);
  const most = experiment.strategy === "direct" ? 0 : experiment.spec.iterations;
  const asked = { experiment: id, repetition: Number(parameters.get("repetition") ?? 0), iteration: Math.min(Number(parameters.get("iteration") ?? 0), most) };
  const figure = h("div", { class: "card toy" });
  const files = h("div");
  const slider = h("input", { type: "range", id: "iteration", min: 0, max: most, step: 1, value: asked.iteration, list: "iterations", oninput: () => step(Number(slider.value)) });
  const marks = h("datalist", { id: "iterations" }, ...Array.from({ length: most + 1 }, (_, each) => h("option", { value: each })));
  const shown = h("output", { for: "iteration", class: "time" });
  const repetition = h("input", { type: "number", min: 0, max: experiment.spec.repetitions - 1, value: asked.repetition, class: "short",
    onchange: () => { if (repetition.value !== "" && repetition.reportValidity()) { asked.repetition = Number(repetition.value); draw(); } } });
  const button = h("button", { type: "button", class: "play", disabled: most === 0, onclick: () => play(timer === null) }, "Play");
  let [refresh, timer] = [null, null];

  function draw() {
    history.replaceState(null, "", `#/toy${search(asked)}`);
    slider.value = asked.iteration;
    slider.setAttribute("aria-valuetext", `iteration ${asked.iteration} of ${most}`);
    shown.textContent = `${asked.iteration} of ${most}`;
    files.replaceChildren(figureFiles("toy", asked, `gaplab-${id}-toy`));
    if (refresh) refresh(asked);
    else refresh = plot(figure, "toy", asked, signal);
  }

  function step(iteration) {
    asked.iteration = Math.min(Math.max(iteration, 0), most);
    draw();
  }

  function play(on) {
    clearInterval(timer);
    timer = on ? setInterval(() => (asked.iteration < most ? step(asked.iteration + 1) : play(false)), STEP_MS) : null;
    button.textContent = on ? "Pause" : "Play";
    if (on && asked.iteration >= most) step(0);
  }

  signal.addEventListener("abort", () => clearInterval(timer));
  addEventListener("keydown", (event) => {
    if (event.target.closest?.("input, select, textarea, button, a") || event.altKey || event.ctrlKey || event.metaKey) return;
    const moves = { ArrowLeft: () => step(asked.iteration - 1), ArrowRight: () => step(asked.iteration + 1), " ": () => play(timer === null) };
    if (!moves[event.key]) return;
    event.preventDefault();
    moves[event.key]();
  }, { signal });
  root.replaceChildren(
    h("h1", {}, "The toy function"),
    h("p", { class: "note" }, h("a", { href: `#/experiments/${id}` }, experiment.name), " · as in the paper's Fig. 3: a function of one gene, its approximations by simulators, and what was tried of it"),
    h("div", { class: "player" }, button, h("label", { for: "iteration" }, "Iteration"), slider, marks, shown, h("label", {}, "Repetition ", repetition),
      h("p", { class: "note" }, "← and → go by an iteration, space plays.")),
    figure, files,
  );
  draw();
}
