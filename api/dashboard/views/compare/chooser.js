// @ts-check
/** Search as you type over experiments and studies: a combobox by the ARIA practices. */

import { get } from "../../lib/api.js";
import { h } from "../../lib/dom.js";
import { age, count, titleOf } from "../../lib/format.js";

const PAUSE_MS = 150;
const FOUND = 12;
const MOST = 100;  // the service's limit for one figure

/** @typedef {{ name: string, description: string, item: Api.StudyRead | Api.ExperimentRead, ids: string[] }} Match */

/**
 * Return the field with the list of matches.
 *
 * @param {Page.CompareView} view
 */
export function chooser(view) {
  const options = h("ul", { id: "found", role: "listbox", "aria-label": "Found", class: "found", hidden: true });
  const message = h("p", { class: "outcome", role: "status" });
  const field = h("input", {
    id: "chooser", type: "search", role: "combobox", autocomplete: "off", placeholder: "name or id of an experiment or a study",
    "aria-expanded": "false", "aria-controls": "found", "aria-autocomplete": "list", maxlength: 200,
  });
  /** @type {AbortController | null} */
  let searching = null;
  /** @type {number | undefined} */
  let timer;
  let active = -1;

  const close = () => {
    options.hidden = true;
    activate(-1);
    field.setAttribute("aria-expanded", "false");
  };
  const activate = (/** @type {number} */ index) => {
    active = index;
    [...options.children].forEach((option, place) => option.setAttribute("aria-selected", String(place === index)));
    const option = options.children[index];
    if (option) field.setAttribute("aria-activedescendant", option.id);
    else field.removeAttribute("aria-activedescendant");
    option?.scrollIntoView({ block: "nearest" });
  };
  const choose = (/** @type {string[]} */ ids) => {
    const { experiments } = view.choice;
    const wanted = [...new Set([...experiments, ...ids])];
    message.textContent = wanted.length > MOST ? `At most ${MOST} experiments can be compared.` : "";
    close();
    field.value = "";
    if (wanted.length > experiments.length) view.change({ experiments: wanted.slice(0, MOST) });
  };
  const showMatches = async () => {
    searching?.abort();
    searching = new AbortController();
    const { signal } = searching;
    try {
      const matches = await search(view, field.value.trim(), signal);
      options.replaceChildren(...(matches.length ? matches.map((match, index) => matchOption(match, index, choose)) : [noMatch()]));
      options.hidden = document.activeElement !== field;
      field.setAttribute("aria-expanded", String(!options.hidden));
      activate(-1);
    } catch (error) {
      if (!signal.aborted) message.textContent = error.message;
    }
  };
  const showSoon = () => {
    close();  // Enter would choose from the matches of the former text
    clearTimeout(timer);
    timer = setTimeout(showMatches, PAUSE_MS);
  };
  const keys = (/** @type {KeyboardEvent} */ event) => {
    const steps = /** @type {Record<string, number>} */ ({ ArrowDown: 1, ArrowUp: -1 });
    const { length } = options.children;
    if (event.key === "Escape") close();
    if (event.key in steps) {
      event.preventDefault();
      if (options.hidden) showMatches();
      else activate((Math.max(active, event.key === "ArrowUp" ? 0 : -1) + steps[event.key] + length) % length);
    }
    if (event.key === "Enter" && !options.hidden) /** @type {HTMLElement | undefined} */ (options.children[Math.max(active, 0)])?.click();
  };
  field.addEventListener("input", showSoon);
  field.addEventListener("focus", showMatches);
  field.addEventListener("keydown", keys);
  field.addEventListener("blur", close);
  view.signal.addEventListener("abort", () => {
    clearTimeout(timer);
    searching?.abort();
  });
  return h("div", { class: "chooser" }, h("label", { for: "chooser" }, "Add experiments"), h("div", { class: "combobox" }, field, options), message);
}

/**
 * Return the studies and the experiments that have a text in their name or id, the newest first; a study of one is its experiment.
 *
 * @param {Page.CompareView} view
 * @param {string} text
 * @param {AbortSignal} signal
 * @returns {Promise<Match[]>}
 */
async function search({ cache, choice }, text, signal) {
  const quoted = `"${text.replace(/["\\]/g, "\\$&")}"`;
  const q = text && `name ~ ${quoted} or id ~ ${quoted} or experiment ~ ${quoted}`;
  /** @type {Api.Page_StudyRead_} */
  const { items } = await get("/studies", { q, limit: FOUND }, signal);
  items.forEach(cache.addStudy);
  const has = (/** @type {string} */ words) => words.toLowerCase().includes(text.toLowerCase());
  const left = items.flatMap(({ experiments }) => experiments).filter(({ id, name }) => !choice.experiments.includes(id) && (has(id) || has(name))).slice(0, FOUND);
  return [
    ...items.filter(({ name, id, experiments }) => experiments.length > 1 && (has(name) || has(id))).map((study) => ({
      name: study.name, description: `study, all ${count(study.experiments.length)} experiments`, item: study, ids: study.experiments.map(({ id }) => id),
    })),
    ...left.map((experiment) => ({
      name: titleOf(experiment), description: cache.studyName(experiment.id) ?? experiment.id, item: experiment, ids: [experiment.id],
    })),
  ];
}

const noMatch = () =>
  h("li", { class: "none", role: "option", "aria-disabled": "true", id: "found-none" }, "No name or id contains this.");

/**
 * @param {Match} match
 * @param {number} index
 * @param {(ids: string[]) => void} choose
 */
function matchOption({ name, description, item, ids }, index, choose) {
  return h("li", {
    id: `found-${index}`, role: "option", "aria-selected": "false", onclick: () => choose(ids),
    onmousedown: (event) => event.preventDefault(),  // the field keeps the focus
  }, h("span", {}, name), h("small", {}, `${description} · ${item.state.toLowerCase()} · ${age(item.created_at)}`));
}
