/** What is listed: studies or experiments, in which state, with which strategy, with which words, in which order. */

import { h } from "../../lib/dom.js";
import { spoken } from "../../lib/format.js";

const STATES = ["QUEUED", "RUNNING", "PAUSING", "PAUSED", "STOPPING", "COMPLETED", "FAILED", "CANCELLED"];
const ORDERS = {
  studies: [["-created_at", "Newest first"], ["created_at", "Oldest first"], ["name", "By name"]],
  experiments: [["-created_at", "Newest first"], ["created_at", "Oldest first"], ["name", "By name"], ["strategy", "By strategy"], ["state", "By state"]],
};
const TYPING_MS = 250;

/** What the address asks for. */
export function wantedBy(parameters) {
  const show = parameters.get("show") === "experiments" ? "experiments" : "studies";
  const sort = ORDERS[show].some(([name]) => name === parameters.get("sort")) ? parameters.get("sort") : "-created_at";
  return { show, sort, state: parameters.get("state") ?? "", strategy: parameters.get("strategy") ?? "", text: parameters.get("text") ?? "" };
}

/** The same as an address, without what goes without saying. */
export function addressOf({ show, ...wanted }) {
  const said = Object.entries({ ...wanted, show: show === "studies" ? "" : show, sort: wanted.sort === "-created_at" ? "" : wanted.sort });
  const query = new URLSearchParams(said.filter(([, value]) => value)).toString();
  return query ? `#/?${query}` : "#/";
}

/** Whether something is left out of the list. */
export const isFiltered = ({ state, strategy, text }) => Boolean(state || strategy || text);

/** The form; `changed(wanted)` is told of every change. */
export function filters(wanted, strategies, changed) {
  let typing = null;
  const now = (change) => {
    Object.assign(wanted, change);
    changed(wanted);
  };
  const kinds = ["studies", "experiments"].map((show) =>
    h("button", { type: "button", "aria-pressed": String(wanted.show === show), onclick: () => now({ show, sort: "-created_at" }) }, spoken(show)));
  const type = (event) => {
    clearTimeout(typing);
    typing = setTimeout(() => now({ text: event.target.value.trim() }), TYPING_MS);
  };
  const search = h("input", { type: "search", placeholder: "Name or id", "aria-label": "Search by name or id", maxlength: 200, oninput: type });
  search.value = wanted.text;
  return h("form", { class: "filters", role: "search", onsubmit: (event) => event.preventDefault() },
    h("div", { class: "segments", role: "group", "aria-label": "What is listed" }, ...kinds), search,
    picker("State", wanted.state, [["", "Any state"], ...STATES.map((each) => [each, spoken(each.toLowerCase())])], (state) => now({ state })),
    picker("Strategy", wanted.strategy, [["", "Any strategy"], ...strategies.map((each) => [each, spoken(each)])], (strategy) => now({ strategy })),
    picker("Order", wanted.sort, ORDERS[wanted.show], (sort) => now({ sort })));
}

function picker(label, value, choices, changed) {
  const field = h("select", { "aria-label": label, onchange: () => changed(field.value) },
    ...choices.map(([name, words]) => h("option", { value: name }, words)));
  field.value = value;
  return field;
}
