/** The token that the service asks for; kept for as long as the tab is open, and sent to this service alone. */

import { h } from "./dom.js";

const KEY = "gaplab-token";

/** The token, or nothing. */
export const token = () => sessionStorage.getItem(KEY);

/** Asks for a token, and goes on with it. */
export function TokenForm(problem, again) {
  const field = h("input", { id: "token", type: "password", autocomplete: "off", required: true });
  const use = (event) => {
    event.preventDefault();
    sessionStorage.setItem(KEY, field.value.trim());
    again();
  };
  const words = problem.status === 401
    ? ["This service lets in whoever has a token. ", h("code", {}, "gaplab token create"), " makes one; it is kept for as long as this tab is open."]
    : [problem.message];
  return h("form", { class: "state token", onsubmit: use },
    h("h1", {}, "A token, please"), h("p", {}, ...words), h("label", { for: "token" }, "Token"), field,
    h("button", { type: "submit" }, "Go on"));
}
