// @ts-check
/** How long ago something was, which goes on while the page is open. */

import { h } from "./dom.js";
import { age } from "./format.js";

const RETIME_MS = 30_000;

/**
 * Return how long ago a moment was.
 *
 * @param {string} time
 */
export const ageOf = (time) => h("time", { datetime: time, title: new Date(time).toLocaleString() }, age(time));

/**
 * Bring the ages below an element up to date now and then, until `signal`.
 *
 * @param {HTMLElement} element
 * @param {AbortSignal} signal
 */
export function keepAges(element, signal) {
  const timer = setInterval(() => {
    for (const time of element.querySelectorAll("time")) time.textContent = age(time.dateTime);
  }, RETIME_MS);
  signal.addEventListener("abort", () => clearInterval(timer));
}
