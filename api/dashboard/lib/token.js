// @ts-check
/** The token that a guarded service asks for: kept while the tab is open, and sent to this service only. */

import { h } from "./dom.js";

const KEY = "gaplab-token";

/** Return the token, or null. */
export const token = () => sessionStorage.getItem(KEY);

/**
 * Return a form that asks for a token, and then tries again.
 *
 * @param {{ status: number, message: string }} problem
 * @param {() => unknown} retry
 */
export function tokenForm(problem, retry) {
  const field = h("input", { id: "token", type: "password", autocomplete: "off", required: true });
  const use = (/** @type {SubmitEvent} */ event) => {
    event.preventDefault();
    sessionStorage.setItem(KEY, field.value.trim());
    retry();
  };
  const text = problem.status === 401
    ? ["This service needs a token. ", h("code", {}, "gaplab token create"), " makes one. This tab keeps it until it is closed."]
    : [problem.message];
  return h("form", { class: "state token", onsubmit: use },
    h("h1", {}, "A token, please"), h("p", {}, ...text), h("label", { for: "token" }, "Token"), field,
    h("button", { type: "submit" }, "Go on"));
}
