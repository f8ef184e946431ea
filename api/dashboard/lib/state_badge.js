// @ts-check
/** A state as a word and a sign, so that no colours need be told apart. */

import { h } from "./dom.js";

/** @type {Record<Api.State, string>} */
const SIGNS = { QUEUED: "○", RUNNING: "▶", PAUSING: "◐", PAUSED: "‖", STOPPING: "◐", COMPLETED: "✓", FAILED: "✕", CANCELLED: "–", WAITING: "◔" };

/** Every state, in the order of a life cycle. */
export const STATES = /** @type {Api.State[]} */ (Object.keys(SIGNS));

/** The states in which nothing happens any more. */
export const ENDED = /** @type {Api.State[]} */ (["COMPLETED", "FAILED", "CANCELLED"]);

const PARTLY = "◑";

/** Return a state as an element; a caveat is what the state alone does not say. @param {Api.State} state @param {string | null} [caveat] */
export const stateBadge = (state, caveat = null) =>
  h("span", { class: `state-badge ${state.toLowerCase()}${caveat ? " partly" : ""}`, title: caveat ?? undefined },
    h("span", { "aria-hidden": "true" }, caveat && ENDED.includes(state) ? PARTLY : SIGNS[state]), " ", state.toLowerCase(),
    ...(caveat ? [h("span", { class: "separator" }, ", "), h("span", { class: "caveat" }, caveat)] : []));
