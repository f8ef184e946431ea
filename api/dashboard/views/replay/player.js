// @ts-check
/** The timeline: play, pause, go to a time, speed; space and the arrow keys do the same. */

import { h } from "../../lib/dom.js";
import { clock } from "../../lib/replay/clock.js";

const SPEEDS = [{ value: 0.25, label: "¼ ×" }, { value: 0.5, label: "½ ×" }, { value: 1, label: "1 ×" }, { value: 2, label: "2 ×" }];
const FRAME_S = 0.02;
const FRAMES_WITH_SHIFT = 10;
const HELP = "Space plays and pauses. ← and → go by one frame, with Shift by ten. Drag a world to turn it; once it has the focus, the arrow keys, + and − do so too.";

/**
 * Return the controls of a replay.
 *
 * @param {number} lengthS
 * @param {(time: number) => void} changed called at each change of the time
 * @param {AbortSignal} signal
 */
export function player(lengthS, changed, signal) {
  const button = h("button", { type: "button", class: "play", onclick: () => { time.play(); } }, "Play");
  const slider = h("input", { type: "range", min: 0, max: lengthS, step: FRAME_S, value: 0, "aria-label": "Time", oninput: () => { time.goTo(Number(slider.value)); } });
  const output = h("output", { class: "time" });
  const speed = h("select", { "aria-label": "Speed", onchange: () => { time.setSpeed(Number(speed.value)); } },
    ...SPEEDS.map(({ value, label }) => h("option", { value, selected: value === 1 }, label)));
  const time = clock(lengthS, {
    signal,
    changed(now) {
      slider.value = String(now);
      slider.setAttribute("aria-valuetext", `${now.toFixed(2)} seconds`);
      output.textContent = `${now.toFixed(2)} s of ${lengthS.toFixed(2)} s`;
      changed(now);
    },
    toggled: (isPlaying) => { button.textContent = isPlaying ? "Pause" : "Play"; },
  });
  addEventListener("keydown", (event) => press(event, time), { signal });
  const element = h("div", { class: "player" }, button, slider, output, h("label", {}, "Speed ", speed), h("p", { class: "note" }, HELP));
  return {
    element,
    /** @param {number} newTime */
    goTo(newTime) {
      time.play(false);
      time.goTo(newTime);
    },
    playOnce: time.playOnce,
    begin() {
      time.goTo(0);
      if (!matchMedia("(prefers-reduced-motion: reduce)").matches) time.play(true);
    },
  };
}

/**
 * @param {KeyboardEvent} event
 * @param {import("../../lib/replay/clock.js").Clock} time
 */
function press(event, time) {
  if (hasOwnUse(event)) return;
  if (event.key === " ") time.play();
  else if (event.key === "ArrowLeft" || event.key === "ArrowRight") {
    time.play(false);
    time.goTo(time.time + (event.key === "ArrowLeft" ? -1 : 1) * FRAME_S * (event.shiftKey ? FRAMES_WITH_SHIFT : 1));
  } else return;
  event.preventDefault();
}

/**
 * Return whether the browser or the focused element has its own use for a key.
 *
 * @param {KeyboardEvent} event
 */
function hasOwnUse(event) {
  const isIn = (/** @type {string} */ selector) => event.target instanceof Element && event.target.closest(selector) !== null;
  if (event.key === " " && isIn("canvas, input[type=range]")) return false;
  return event.altKey || event.ctrlKey || event.metaKey || isIn("input, select, textarea, button, a, canvas, [role=tab]");
}
