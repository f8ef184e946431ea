// @ts-check
/** The toy of the paper's Fig. 3, iteration by iteration: truth, tuned approximations, samples and transfer. */

import { get, queryString } from "../lib/api.js";
import { h } from "../lib/dom.js";
import { figureDownloads } from "../lib/downloads.js";
import { empty } from "../lib/placeholders.js";
import { plot } from "../lib/plot.js";

const STEP_MS = 1300;

/**
 * Fill `root` with the iterations of one repetition of the experiment that the parameters name, until `signal`.
 * @param {HTMLElement} root
 * @param {URLSearchParams} parameters
 * @param {AbortSignal} signal
 */
export async function show(root, parameters, signal) {
  const id = parameters.get("experiment");
  if (!id) {
    const link = h("a", { href: "#/new", class: "button" }, "New study");
    root.replaceChildren(h("h1", {}, "The toy function"), empty("An experiment whose robot is a function of one gene can be stepped through, from its own page.", link));
    return;
  }
  /** @type {Api.ExperimentRead} */
  const { name, level, spec } = await get(`/experiments/${id}`, {}, signal);
  const last = level ? 0 : spec.iterations;
  const query = { experiment: id, repetition: Number(parameters.get("repetition") ?? 0), iteration: Math.min(Number(parameters.get("iteration") ?? 0), last) };
  const figure = h("div", { class: "card toy" });
  const drawFigure = plot(figure, "toy", signal);
  const downloads = h("div");
  const slide = () => { goTo(Number(slider.value)); };
  const slider = h("input", { type: "range", id: "iteration", min: 0, max: last, step: 1, value: query.iteration, list: "iterations", oninput: slide });
  const marks = h("datalist", { id: "iterations" }, ...Array.from({ length: last + 1 }, (_, iteration) => h("option", { value: iteration })));
  const output = h("output", { for: "iteration", class: "time" });
  const changeRepetition = () => {
    if (repetition.value === "" || !repetition.reportValidity()) return;
    query.repetition = Number(repetition.value);
    draw();
  };
  const repetition = h("input", { type: "number", min: 0, max: spec.repetitions - 1, value: query.repetition, class: "short", onchange: changeRepetition });
  const button = h("button", { type: "button", class: "play", disabled: last === 0, onclick: () => { toggle(); } }, "Play");
  /** @type {number | undefined} */
  let timer;

  function draw() {
    history.replaceState(null, "", `#/toy${queryString(query)}`);
    slider.value = String(query.iteration);
    slider.setAttribute("aria-valuetext", `iteration ${query.iteration} of ${last}`);
    output.textContent = `${query.iteration} of ${last}`;
    downloads.replaceChildren(figureDownloads("toy", query, `gaplab-${id}-toy`));
    drawFigure({ ...query });
  }

  /** @param {number} iteration */
  function goTo(iteration) {
    query.iteration = Math.min(Math.max(iteration, 0), last);
    draw();
  }

  function toggle(isPlaying = timer === undefined) {
    clearInterval(timer);
    timer = isPlaying ? setInterval(() => (query.iteration < last ? goTo(query.iteration + 1) : toggle(false)), STEP_MS) : undefined;
    button.textContent = isPlaying ? "Pause" : "Play";
    if (isPlaying && query.iteration >= last) goTo(0);
  }

  signal.addEventListener("abort", () => clearInterval(timer));
  /** @type {Record<string, () => void>} */
  const keys = { ArrowLeft: () => goTo(query.iteration - 1), ArrowRight: () => goTo(query.iteration + 1), " ": () => toggle() };
  addEventListener("keydown", (event) => {
    const hasOwnUse = event.target instanceof Element && event.target.closest("input, select, textarea, button, a");
    if (hasOwnUse || event.altKey || event.ctrlKey || event.metaKey || !(event.key in keys)) return;
    event.preventDefault();
    keys[event.key]();
  }, { signal });
  root.replaceChildren(
    h("h1", {}, "The toy function"),
    h("p", { class: "note" }, h("a", { href: `#/experiments/${id}` }, name),
      " · as in the paper's Fig. 3: a function of one gene, its approximations by simulators, and the samples of it"),
    h("div", { class: "player" }, button, h("label", { for: "iteration" }, "Iteration"), slider, marks, output, h("label", {}, "Repetition ", repetition),
      h("p", { class: "note" }, "← and → go by one iteration. Space plays and pauses.")),
    figure, downloads,
  );
  draw();
}
