// @ts-check
/** The filters of the list: all, studies or experiments, in which state, with which strategy and words, in which order. */

import { h } from "../../lib/dom.js";
import { readableName } from "../../lib/format.js";
import { STATES } from "../../lib/state_badge.js";

/** @typedef {{ show: "all" | "studies" | "experiments", sort: string, state: string, strategy: string, text: string, q: string }} Filters */
/** @typedef {[value: string, label: string][]} Choices */

/** @type {Choices} */
const STUDY_ORDERS = [["-created_at", "Newest first"], ["created_at", "Oldest first"], ["name", "By name"], ["-name", "By name, reversed"]];
/** @type {Choices} */
const EXPERIMENT_ORDERS = [...STUDY_ORDERS,
  ["strategy", "By strategy"], ["-strategy", "By strategy, reversed"], ["state", "By state"], ["-state", "By state, reversed"]];
const ORDERS = { all: STUDY_ORDERS, studies: STUDY_ORDERS, experiments: EXPERIMENT_ORDERS };
const NEWEST_FIRST = "-created_at";
const TYPING_MS = 350;

/**
 * Return the filters in an address.
 *
 * @param {URLSearchParams} parameters
 * @returns {Filters}
 */
export function filtersOf(parameters) {
  const wanted = parameters.get("show");
  const show = wanted === "studies" || wanted === "experiments" ? wanted : "all";
  const order = ORDERS[show].find(([name]) => name === parameters.get("sort"));
  const value = (/** @type {string} */ name) => parameters.get(name) ?? "";
  return { show, sort: order ? order[0] : NEWEST_FIRST, state: value("state"), strategy: value("strategy"), text: value("text"), q: value("q") };
}

/**
 * Return the address of filters, without those that have their default.
 *
 * @param {Filters} filters
 */
export function addressOf({ show, sort, ...others }) {
  const values = { ...others, show: show === "all" ? "" : show, sort: sort === NEWEST_FIRST ? "" : sort };
  const query = new URLSearchParams(Object.entries(values).filter(([, value]) => value)).toString();
  return query ? `#/?${query}` : "#/";
}

/**
 * Return whether the filters leave something out of the list.
 *
 * @param {Filters} filters
 */
export const isFiltered = ({ state, strategy, text, q }) => Boolean(state || strategy || text || q);

/**
 * Return the form of the filters.
 *
 * @param {Filters} filters changed in place
 * @param {string[]} strategies
 * @param {(filters: Filters) => void} changed
 */
export function filterForm(filters, strategies, changed) {
  /** @type {number | undefined} */
  let typing;
  const change = (/** @type {Partial<Filters>} */ changes) => {
    Object.assign(filters, changes);
    changed(filters);
  };
  const kinds = /** @type {const} */ (["all", "studies", "experiments"]).map((show) => {
    const press = () => change({ show, sort: NEWEST_FIRST });
    return h("button", { type: "button", "aria-pressed": String(filters.show === show), onclick: press }, readableName(show));
  });
  const type = () => {
    clearTimeout(typing);
    const words = { text: "", q: search.value.trim() };
    history.replaceState(null, "", addressOf({ ...filters, ...words }));  // at once, so that it can be copied
    typing = setTimeout(() => change(words), TYPING_MS);
  };
  const search = h("input", { type: "search", placeholder: "Words, or a query like tag = gait", "aria-label": "Search by words or a query", maxlength: 1000, oninput: type });
  search.value = filters.q || filters.text;
  /** @type {Choices} */
  const states = STATES.map((state) => [state, readableName(state.toLowerCase())]);
  /** @type {Choices} */
  const names = strategies.map((name) => [name, readableName(name)]);
  return h("form", { class: "filters", role: "search", onsubmit: (event) => event.preventDefault() },
    h("div", { class: "segments", role: "group", "aria-label": "All, studies or experiments" }, ...kinds), search,
    select("State", filters.state, [["", "Any state"], ...states], (state) => change({ state })),
    select("Strategy", filters.strategy, [["", "Any strategy"], ...names], (strategy) => change({ strategy })),
    select("Order", filters.sort, ORDERS[filters.show], (sort) => change({ sort })));
}

/**
 * @param {string} label
 * @param {string} value
 * @param {Choices} choices
 * @param {(value: string) => void} changed
 */
function select(label, value, choices, changed) {
  const options = choices.map(([name, words]) => h("option", { value: name }, words));
  const field = h("select", { "aria-label": label, onchange: () => { changed(field.value); } }, ...options);
  field.value = value;
  return field;
}
