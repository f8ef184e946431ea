// @ts-check
/** A state as a word and a sign, so that no colours need be told apart. */

import { h } from "./dom.js";

/** @type {Record<Api.State, string>} */
const SIGNS = { QUEUED: "○", RUNNING: "▶", PAUSING: "◐", PAUSED: "‖", STOPPING: "◐", COMPLETED: "✓", FAILED: "✕", CANCELLED: "–" };

/** Every state, in the order of a life cycle. */
export const STATES = /** @type {Api.State[]} */ (Object.keys(SIGNS));

/** The states in which nothing happens any more. */
export const ENDED = /** @type {Api.State[]} */ (["COMPLETED", "FAILED", "CANCELLED"]);

/**
 * Return a state as an element.
 *
 * @param {Api.State} state
 */
export const stateBadge = (state) =>
  h("span", { class: `state-badge ${state.toLowerCase()}` }, h("span", { "aria-hidden": "true" }, SIGNS[state]), " ", state.toLowerCase());
