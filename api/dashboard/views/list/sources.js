// @ts-check
/** Where the rows of the list come from: one list of the service, or studies and single experiments, merged. */

import { get } from "../../lib/api.js";
import { restOfList } from "./merging.js";

/** @typedef {Api.StudyRead | Api.ExperimentRead} Item */
/** @typedef {import("./filters.js").Filters} Filters */

/**
 * @typedef {object} Source one list of the service, as far as it is loaded
 * @property {string} path
 * @property {Page.Query} query
 * @property {Item[]} items
 * @property {string | null} cursor of the next part; null at the end
 */

/**
 * Return the sources of a list, with nothing loaded.
 *
 * @param {Filters} filters
 * @returns {Source[]}
 */
export function sourcesOf({ show, ...query }) {
  const studies = { path: "/studies", query, items: [], cursor: null };
  if (show === "studies") return [studies];
  const experiments = { path: "/experiments", query, items: [], cursor: null };
  return show === "experiments" ? [experiments] : [studies, { ...experiments, query: { ...query, alone: true } }];
}

/**
 * Load the first part of a source again; the rest stays.
 *
 * @param {Source} source
 * @param {number} limit
 * @param {AbortSignal} signal
 * @returns {Promise<Source>}
 */
export async function refreshed(source, limit, signal) {
  const page = await get(source.path, { ...source.query, limit }, signal);
  const rest = source.items.length > limit ? restOfList(page.items, source.items) : [];
  return { ...source, items: [...page.items, ...rest], cursor: rest.length ? source.cursor : page.next };
}

/**
 * Load the next part of a source.
 *
 * @param {Source} source
 * @param {number} limit
 * @param {AbortSignal} signal
 * @returns {Promise<Source>}
 */
export async function lengthened(source, limit, signal) {
  const page = await get(source.path, { ...source.query, limit, cursor: source.cursor }, signal);
  return { ...source, items: [...source.items, ...page.items], cursor: page.next };
}

/**
 * Return the items of all sources in their common order, up to the first that is not loaded, and the sources that have it.
 *
 * @param {Source[]} sources
 * @param {string} sort
 * @returns {{ items: Item[], ending: Source[] }}
 */
export function merged(sources, sort) {
  const places = sources.map(() => 0);
  const heads = () => sources.map(({ items }, index) => items[places[index]]);
  /** @type {Item[]} */
  const items = [];
  for (;;) {
    const next = heads();
    const ending = sources.filter(({ cursor }, index) => cursor && !next[index]);
    if (ending.length || next.every((item) => !item)) return { items, ending };
    const first = next.reduce((best, item, index) => (item && (best < 0 || comesBefore(item, /** @type {Item} */ (next[best]), sort)) ? index : best), -1);
    items.push(/** @type {Item} */ (next[first]));
    places[first] += 1;
  }
}

/**
 * @param {Item} one
 * @param {Item} other
 * @param {string} sort
 */
function comesBefore(one, other, sort) {
  if (sort === "name") return one.name < other.name;
  if (sort === "-name") return one.name > other.name;
  const sooner = Date.parse(one.created_at) - Date.parse(other.created_at);
  return sort.startsWith("-") ? sooner > 0 : sooner < 0;
}
