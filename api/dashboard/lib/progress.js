// @ts-check
/** Progress as a bar and in per cent. */

import { h, setText } from "./dom.js";
import { percent } from "./format.js";

/** Return a bar with its per cent. @param {string} label @returns {Page.Updatable<Api.Progress>} */
export function progressBar(label) {
  const bar = h("progress", { max: 1, "aria-label": label });
  const shownPercent = h("span", { class: "percent" });
  const update = (/** @type {Api.Progress} */ progress) => {
    bar.value = progress.share;
    setText(shownPercent, percent(progress.share));
    bar.title = progress.text;
  };
  return { element: h("span", { class: "bar-of" }, bar, shownPercent), update };
}

/**
 * Return the time left; nothing unless the experiment or study is running, and neither pausing nor stopping.
 * @param {{ state: Api.State, progress: Api.Progress }} item
 */
export function timeLeft({ state, progress }, otherwise = "") {
  return state === "RUNNING" ? (progress.time_left?.text ?? "not known yet") : otherwise;
}
