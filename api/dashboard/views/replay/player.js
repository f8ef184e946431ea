/** The timeline: play, pause, scrub, speed; space and the arrow keys do the same. */

import { h } from "../../lib/dom.js";
import { clock } from "../../lib/replay/clock.js";

const SPEEDS = [[0.25, "¼ ×"], [0.5, "½ ×"], [1, "1 ×"], [2, "2 ×"]];
const FRAME_S = 0.02;
const still = matchMedia("(prefers-reduced-motion: reduce)");

/** The controls of so many seconds, of which each change goes to `changed(time)`. */
export function player(lengthS, changed, signal) {
  const button = h("button", { type: "button", class: "play", onclick: () => time.play() }, "Play");
  const scrub = h("input", { type: "range", min: 0, max: lengthS, step: FRAME_S, value: 0, "aria-label": "Time", oninput: () => time.to(Number(scrub.value)) });
  const shown = h("output", { class: "time" });
  const speed = h("select", { "aria-label": "Speed", onchange: () => time.at(Number(speed.value)) },
    ...SPEEDS.map(([value, words]) => h("option", { value, selected: value === 1 }, words)));
  const time = clock(lengthS, {
    signal,
    changed(now) {
      scrub.value = now;
      scrub.setAttribute("aria-valuetext", `${now.toFixed(2)} seconds`);
      shown.textContent = `${now.toFixed(2)} s of ${lengthS.toFixed(2)} s`;
      changed(now);
    },
    state: (playing) => { button.textContent = playing ? "Pause" : "Play"; },
  });
  addEventListener("keydown", (event) => keys(event, time), { signal });
  const element = h("div", { class: "player" }, button, scrub, shown, h("label", {}, "Speed ", speed),
    h("p", { class: "note" }, "Space plays and pauses; ← and → move by a frame, with Shift by ten. Drag a world to go round it; with it focused, arrows, + and − do the same."));
  return {
    element,
    to(wanted) {
      time.play(false);
      time.to(wanted);
    },
    begin() {
      time.to(0);
      if (!still.matches) time.play(true);
    },
  };
}

/** What has a use of its own for a key keeps it. */
function keys(event, time) {
  if (event.altKey || event.ctrlKey || event.metaKey || event.target.closest?.("input, select, textarea, button, a, canvas, [role=tab]")) {
    if (!(event.key === " " && event.target.closest?.("canvas, input[type=range]"))) return;
  }
  if (event.key === " ") time.play();
  else if (event.key === "ArrowLeft" || event.key === "ArrowRight") {
    time.play(false);
    time.to(time.time + (event.key === "ArrowLeft" ? -1 : 1) * FRAME_S * (event.shiftKey ? 10 : 1));
  } else return;
  event.preventDefault();
}
