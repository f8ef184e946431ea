// @ts-check
/** The settings in which the chosen experiments differ, and why they should not be compared: what the service says. */

import { get } from "../../lib/api.js";
import { h } from "../../lib/dom.js";
import { failed, loading } from "../../lib/placeholders.js";
import { table } from "../../lib/table.js";

/**
 * Return the warnings and the table of settings, which are loaded for each other choice of experiments.
 *
 * @param {Page.CompareView} view
 * @returns {Page.Updatable & { warnings: HTMLElement }}
 */
export function settings(view) {
  const place = h("div");
  const warnings = h("div", { class: "remarks", role: "status" });
  const element = h("section", { class: "card", "aria-labelledby": "settings-title" }, h("h2", { id: "settings-title" }, "Settings that differ"), place);
  let lastKey = "";
  const load = async (/** @type {string[]} */ ids, /** @type {() => boolean} */ isCurrent) => {
    if (!place.hasChildNodes()) place.replaceChildren(loading());
    try {
      /** @type {Api.SpecDiff} */
      const found = await get("/differences", { study: ids }, view.signal);
      if (!isCurrent()) return;
      const texts = found.warnings.map((text) => h("p", {}, `⚠ ${text[0].toUpperCase()}${text.slice(1)}.`));
      warnings.replaceChildren(...(texts.length ? [h("div", { class: "remark warned" }, ...texts)] : []));
      place.replaceChildren(...shown(found, view.cache.namesOf(ids)));
    } catch (error) {
      if (isCurrent()) place.replaceChildren(failed(error, () => load(ids, isCurrent), "h3"));
    }
  };
  const update = () => {
    const ids = view.cache.known(view.choice.experiments);
    element.hidden = ids.length < 2;
    if (element.hidden) warnings.replaceChildren();
    const states = ids.map((id) => view.cache.get(id)?.ended_at);  // hidden parameters appear at the end
    const key = JSON.stringify([ids, states]);
    if (key === lastKey) return;
    lastKey = key;
    if (!element.hidden) load(ids, () => key === lastKey && !view.signal.aborted);
  };
  return { element, warnings, update };
}

/**
 * @param {Api.SpecDiff} found
 * @param {Map<string, string>} names
 */
function shown({ columns, settings: differing, note: text }, names) {
  const note = h("p", { class: "note" }, text);
  if (!differing.length) return [note];
  const heads = ["Setting", ...columns.map(({ id, name }) => names.get(id) ?? name)];
  const rows = differing.map(({ pointer, setting, texts }) => [
    h("span", { title: pointer }, setting, " ", h("code", { class: "pointer" }, pointer)), ...texts]);
  return [table("Settings that differ", heads, rows), note];
}
