/** What a view shows while it has nothing to show: it loads, there is nothing, or it failed. */

import { TokenForm } from "./token.js";
import { Problem } from "./api.js";
import { h } from "./dom.js";

const AGAIN_MS = 2000;

/** Something is on its way. */
export function loading(words = "Loading…") {
  return h("p", { class: "state loading", role: "status" }, h("span", { class: "spinner", "aria-hidden": "true" }), words);
}

/** There is nothing yet, and what one does about it. */
export function empty(words, ...action) {
  return h("div", { class: "state empty" }, h("p", {}, words), ...action);
}

/** It failed, with the service's own words; `again` tries once more. In a part of a view its heading is a lower one. */
export function failed(error, again, heading = "h1") {
  if (error instanceof Problem && (error.status === 401 || error.status === 403)) return TokenForm(error, again);
  if (error instanceof Problem && error.status === 0) return away(error, again, heading);
  const title = error instanceof Problem ? error.title : "It did not work";
  const places = error.errors?.map((each) => h("li", {}, each.pointer ? h("code", {}, each.pointer) : "", " ", each.message)) ?? [];
  return h("div", { class: "state failed", role: "alert" },
    h(heading, {}, title), h("p", {}, error.message), places.length ? h("ul", {}, ...places) : null,
    again ? h("button", { type: "button", onclick: () => again() }, "Try again") : null);
}

/** The service does not answer: it is asked again by itself, and by a press. */
function away(error, again, heading) {
  const element = h("div", { class: "state away-now", role: "status" }, h(heading, {}, error.title), h("p", {}, error.message),
    h("p", {}, h("span", { class: "spinner", "aria-hidden": "true" }), "Asking again until it does…"),
    again ? h("button", { type: "button", class: "quiet", onclick: () => again() }, "Try now") : null);
  if (again && heading !== "h1") setTimeout(() => { if (element.isConnected) again(); }, AGAIN_MS);  // a whole view is asked again by what shows it
  return element;
}
