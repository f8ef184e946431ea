/** How far something is, as a bar and in per cent; of rollouts, which is where the time goes. */

import { h } from "./dom.js";
import { count, duration } from "./format.js";
import { say } from "./rows.js";

/** How much is behind it, between 0 and 1. */
export function fraction(progress) {
  return progress.rollouts ? Math.min(1, (progress.rollouts_done + progress.rollouts_saved) / progress.rollouts) : 0;
}

/** A bar with its per cent, and `update(progress)`. */
export function progressBar(label) {
  const bar = h("progress", { max: 1, "aria-label": label });
  const words = h("span", { class: "percent" });
  const update = (progress) => {
    bar.value = fraction(progress);
    say(words, `${Math.floor(100 * fraction(progress))} %`);
    const rollouts = `${count(progress.rollouts_done)} rollouts and ${count(progress.rollouts_saved)} saved of ${count(progress.rollouts)}`;
    bar.title = `${count(progress.completed)} of ${count(progress.repetitions)} repetitions, ${rollouts}`;
  };
  return { element: h("span", { class: "bar-of" }, bar, words), update };
}

/** What is left, in words: only what runs has a time. */
export function timeLeft({ state, progress }) {
  if (!["RUNNING", "PAUSING", "STOPPING"].includes(state)) return "";
  return progress.seconds_left === null ? "…" : duration(progress.seconds_left);
}
