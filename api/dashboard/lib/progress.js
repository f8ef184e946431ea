// @ts-check
/** Progress as a bar and in per cent of the rollouts, which take nearly all of the time. */

import { h, setText } from "./dom.js";
import { count, durationRange, percent } from "./format.js";

const MOST_STEPS = 5;

/** Return the share that is done, between 0 and 1; a saved rollout is done. @param {Api.Progress} progress */
export function fraction(progress) {
  return progress.rollouts ? Math.min(1, (progress.rollouts_done + progress.rollouts_saved) / progress.rollouts) : 0;
}

/** Return the number of rollouts, with those that were saved. @param {Api.Progress} progress */
export const rolloutsDone = ({ rollouts_done: done, rollouts: all, rollouts_saved: saved }) =>
  `${count(done)} of ${count(all)}${saved ? `, ${count(saved)} saved` : ""}`;

/**
 * Return the facts of completed work and of the steps under way. Iterations are counted as in a spec: without number 0.
 * @param {Api.Progress} progress
 */
export function workFacts(progress) {
  const { completed, repetitions, failed, counted_iterations: iterations, counted_iterations_done: done, rollouts_failed: broken, steps } = progress;
  const shares = steps.map(({ kind, iteration, rollouts, budget }) => `${kind} ${iteration}: ${percent(rollouts / budget)}`);
  /** @type {import("./table.js").Fact[]} */
  const facts = [
    ["Repetitions", `${count(completed)} of ${count(repetitions)}${failed ? `, ${count(failed)} failed` : ""}`],
    ["Iterations", iterations ? `${count(done)} of ${count(iterations)}` : ""],
    ["Rollouts", `${rolloutsDone(progress)}${broken ? `, physics failed in ${count(broken)}` : ""}`],
    ["Now", [...shares.slice(0, MOST_STEPS), ...(shares.length > MOST_STEPS ? ["…"] : [])].join(", ")],
  ];
  return facts.filter(([, text]) => text);
}

/** Return a bar with its per cent. @param {string} label @returns {Page.Updatable<Api.Progress>} */
export function progressBar(label) {
  const bar = h("progress", { max: 1, "aria-label": label });
  const shownPercent = h("span", { class: "percent" });
  const update = (/** @type {Api.Progress} */ progress) => {
    bar.value = fraction(progress);
    setText(shownPercent, percent(fraction(progress)));
    bar.title = `${count(progress.completed)} of ${count(progress.repetitions)} repetitions; rollouts: ${rolloutsDone(progress)}`;
  };
  return { element: h("span", { class: "bar-of" }, bar, shownPercent), update };
}

/**
 * Return the time left; nothing unless the experiment or study is running, and neither pausing nor stopping.
 * @param {{ state: Api.State, progress: Api.Progress }} item
 */
export function timeLeft({ state, progress }) {
  if (state !== "RUNNING") return "";
  return progress.time_left ? durationRange(progress.time_left) : "not known yet";
}

/** Return the time left as a fact: a dash unless it is running. @param {{ state: Api.State, progress: Api.Progress }} item */
export const timeLeftFact = (item) => timeLeft(item) || "–";
