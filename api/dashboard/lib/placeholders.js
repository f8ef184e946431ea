// @ts-check
/** What stands in a view that has nothing to show: it is loading, there is nothing, or it failed. */

import { keepToken, Problem } from "./api.js";
import { h } from "./dom.js";

const RETRY_MS = 2000;

/** Return a note that something is loading. @param {string} [text] */
export function loading(text = "Loading…") {
  return h("p", { class: "state loading", role: "status" }, spinner(), text);
}

/** Return a note that there is nothing yet, with what the reader can do about it. @param {string} text @param {...HTMLElement} actions */
export function empty(text, ...actions) {
  return h("div", { class: "state empty" }, h("p", {}, text), ...actions);
}

/**
 * Return an error in the service's own words, with a way to try again.
 * @param {any} error
 * @param {() => unknown} retry
 * @param {"h1" | "h2" | "h3"} [heading] a lower one in a section of a view
 */
export function failed(error, retry, heading = "h1") {
  if (!(error instanceof Problem)) return failure("It did not work", error.message, heading, retry);
  if (error.status === 401 || error.status === 403) return tokenForm(error, retry);
  if (error.status === 0) return away(error, retry, heading);
  const several = error.errors.length > 1 ? error.errors : [];  // the message tells a single one
  const items = several.map(({ pointer, message }) => h("li", {}, pointer ? h("code", {}, pointer) : "", " ", message));
  const home = heading === "h1" && error.status === 404 ? h("a", { class: "button quiet", href: "#/" }, "To the studies") : null;
  return failure(error.title, error.message, heading, retry, items, home);
}

/**
 * @param {string} title
 * @param {string} text
 * @param {"h1" | "h2" | "h3"} heading
 * @param {() => unknown} retry
 * @param {HTMLElement[]} [items]
 * @param {HTMLElement | null} [home]
 */
function failure(title, text, heading, retry, items = [], home = null) {
  return h("div", { class: "state failed", role: "alert" }, h(heading, {}, title), h("p", {}, text), items.length ? h("ul", {}, ...items) : null,
    h("button", { type: "button", onclick: () => retry() }, "Try again"), " ", home);
}

/**
 * Return a note that the service does not answer. It tries again by itself, and at a press.
 * @param {Problem} problem
 * @param {() => unknown} retry
 * @param {"h1" | "h2" | "h3"} heading
 */
function away(problem, retry, heading) {
  const element = h("div", { class: "state away-now", role: "status" }, h(heading, {}, problem.title), h("p", {}, problem.message),
    h("p", {}, spinner(), "Trying again until it does…"),
    h("button", { type: "button", class: "quiet", onclick: () => retry() }, "Try now"));
  if (heading !== "h1") setTimeout(() => { if (element.isConnected) retry(); }, RETRY_MS);  // app.js retries a whole view
  return element;
}

const spinner = () => h("span", { class: "spinner", "aria-hidden": "true" });

/** Return a form that asks for a token, and then tries again. @param {{ status: number, message: string }} problem @param {() => unknown} retry */
function tokenForm(problem, retry) {
  const field = h("input", { id: "token", type: "password", autocomplete: "off", required: true });
  const use = (/** @type {SubmitEvent} */ event) => {
    event.preventDefault();
    keepToken(field.value.trim());
    retry();
  };
  const text = problem.status === 401
    ? ["This service needs a token. ", h("code", {}, "gaplab token create"), " makes one. This tab keeps it until it is closed."]
    : [problem.message];
  return h("form", { class: "state token", onsubmit: use },
    h("h1", {}, "A token, please"), h("p", {}, ...text), h("label", { for: "token" }, "Token"), field,
    h("button", { type: "submit" }, "Go on"));
}
