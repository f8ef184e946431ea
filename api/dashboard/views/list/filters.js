// @ts-check
/** The filters of the list: in which state, with which strategy and words, in which order. */

import { h, select } from "../../lib/dom.js";
import { readableName } from "../../lib/format.js";
import { STATES } from "../../lib/state_badge.js";

/** @typedef {{ sort: string, state: string, strategy: string, text: string, q: string }} Filters */

/** @type {[value: string, label: string][]} */
const ORDERS = [["-created_at", "Newest first"], ["created_at", "Oldest first"], ["name", "By name"], ["-name", "By name, reversed"],
  ["-fitness", "Fittest first"], ["fitness", "Fittest last"], ["state", "By state"], ["-state", "By state, reversed"]];
const NEWEST_FIRST = "-created_at";
const TYPING_MS = 350;

/** Return the filters in an address. @param {URLSearchParams} parameters @returns {Filters} */
export function filtersOf(parameters) {
  const value = (/** @type {string} */ name) => parameters.get(name) ?? "";
  const [sort] = ORDERS.find(([name]) => name === value("sort")) ?? [NEWEST_FIRST];
  return { sort, state: value("state"), strategy: value("strategy"), text: value("text"), q: value("q") };
}

/** Return the address of filters, without those that have their default. @param {Partial<Filters>} filters */
export function addressOf({ sort = NEWEST_FIRST, ...others }) {
  const values = { ...others, sort: sort === NEWEST_FIRST ? "" : sort };
  const query = new URLSearchParams(Object.entries(values).filter(([, value]) => value)).toString();
  return query ? `#/?${query}` : "#/";
}

/** Return whether the filters leave something out of the list. @param {Filters} filters */
export const isFiltered = ({ state, strategy, text, q }) => Boolean(state || strategy || text || q);

/**
 * Return the form of the filters; an update shows an order that was chosen elsewhere.
 * @param {Filters} filters changed in place
 * @param {string[]} strategies
 * @param {(filters: Filters) => void} changed
 * @returns {Page.Updatable}
 */
export function filterForm(filters, strategies, changed) {
  /** @type {number | undefined} */
  let typing;
  const change = (/** @type {Partial<Filters>} */ changes) => changed(Object.assign(filters, changes));
  const type = () => {
    clearTimeout(typing);
    const words = { text: "", q: search.value.trim() };
    history.replaceState(null, "", addressOf({ ...filters, ...words }));  // at once, so that it can be copied
    typing = setTimeout(() => change(words), TYPING_MS);
  };
  const search = h("input", { type: "search", placeholder: "Words, or a query like tag = gait", "aria-label": "Search by words or a query", maxlength: 1000, oninput: type });
  search.value = filters.q || filters.text;
  /** @type {(name: "state" | "strategy" | "sort", label: string, choices: Page.Choices) => HTMLSelectElement} */
  const choice = (name, label, choices) => {
    const field = select(choices, { "aria-label": label, onchange: () => change({ [name]: field.value }) });
    field.value = filters[name];
    return field;
  };
  const order = choice("sort", "Order", ORDERS);
  const element = h("form", { class: "filters", role: "search", onsubmit: (event) => event.preventDefault() }, search,
    choice("state", "State", [["", "Any state"], ...STATES.map((state) => /** @type {[string, string]} */ ([state, readableName(state.toLowerCase())]))]),
    choice("strategy", "Strategy", [["", "Any strategy"], ...strategies.map((name) => /** @type {[string, string]} */ ([name, readableName(name)]))]),
    order);
  return { element, update: () => { order.value = filters.sort; } };
}
