// @ts-check
/** The settings in which the chosen experiments differ; all others are equal. */

import { get } from "../../lib/api.js";
import { h } from "../../lib/dom.js";
import { failed, loading } from "../../lib/placeholders.js";
import { table } from "../../lib/table.js";

/**
 * Return the table of settings, which is loaded for each other choice of experiments.
 *
 * @param {Page.CompareView} view
 * @returns {Page.ComparePart}
 */
export function settings(view) {
  const place = h("div");
  const element = h("section", { class: "card", "aria-labelledby": "settings-title" }, h("h2", { id: "settings-title" }, "Settings that differ"), place);
  let lastKey = "";
  const update = () => {
    const ids = view.cache.known(view.choice.experiments);
    element.hidden = ids.length < 2;
    const states = ids.map((id) => view.cache.get(id)?.ended_at);  // hidden parameters appear at the end
    const key = JSON.stringify([ids, states]);
    if (element.hidden || key === lastKey) return;
    lastKey = key;
    fill(place, view, ids, () => key === lastKey && !view.signal.aborted);
  };
  return { element, update };
}

/**
 * @param {HTMLElement} place
 * @param {Page.CompareView} view
 * @param {string[]} ids
 * @param {() => boolean} isCurrent
 */
async function fill(place, view, ids, isCurrent) {
  if (!place.hasChildNodes()) place.replaceChildren(loading());
  try {
    /** @type {Api.SpecDiff} */
    const found = await get("/differences", { study: ids }, view.signal);
    if (isCurrent()) place.replaceChildren(...shown(found, view.cache.namesOf(ids)));
  } catch (error) {
    if (isCurrent()) place.replaceChildren(failed(error, () => fill(place, view, ids, isCurrent), "h3"));
  }
}

/**
 * @param {Api.SpecDiff} found
 * @param {Map<string, string>} names
 */
function shown({ columns, settings: differing, equal, hidden }, names) {
  const note = h("p", { class: "note" }, `${equal} other settings are equal.`,
    hidden.length ? ` Parameters of reality are compared once they may be shown: ${hidden.length} are hidden.` : "");
  if (!differing.length) return [note];
  const heads = ["Setting", ...columns.map(({ id, name }) => names.get(id) ?? name)];
  const rows = differing.map(({ pointer, setting, values }) => [
    h("span", { title: pointer }, setting, " ", h("code", { class: "pointer" }, pointer)), ...values.map(cellText)]);
  return [table("Settings that differ", heads, rows), note];
}

/**
 * Return the values of one column in words; a dash where there is no such setting.
 *
 * @param {any[]} values
 */
export const cellText = (values) => values.map(valueText).join(", ") || "–";

/**
 * @param {any} value of JSON
 * @returns {string}
 */
function valueText(value) {
  if (Array.isArray(value)) return value.map((part) => valueText(part).replaceAll("_", " ")).join(" + ");
  if (value === null) return "none";
  if (typeof value === "boolean") return value ? "yes" : "no";
  return typeof value === "string" ? value.replaceAll("_", " ") : String(value);
}
