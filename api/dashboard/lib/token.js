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
  return h("form", { class: "state", onsubmit: use },
    h("h1", {}, "A token, please"), h("p", {}, problem.message), h("label", { for: "token" }, "Token"), field,
    h("button", { type: "submit" }, "Go on"));
}
