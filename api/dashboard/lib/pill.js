/** A state as a word and a sign, so that no colour need be told apart. */

import { h } from "./dom.js";

const SIGNS = { QUEUED: "○", RUNNING: "▶", PAUSING: "◐", PAUSED: "‖", STOPPING: "◐", COMPLETED: "✓", FAILED: "✕", CANCELLED: "–" };

/** The state, as an element. */
export const pill = (state) =>
  h("span", { class: `pill ${state.toLowerCase()}` }, h("span", { "aria-hidden": "true" }, SIGNS[state]), " ", state.toLowerCase());
