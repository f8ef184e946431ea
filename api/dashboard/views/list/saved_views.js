// @ts-check
/** Saved views above the list, which all users share, and how to write a query. */

import { get, put, remove } from "../../lib/api.js";
import { openDialog } from "../../lib/dialog.js";
import { button, h } from "../../lib/dom.js";
import { addressOf } from "./filters.js";

/** @typedef {import("./filters.js").Filters} Filters */

const EXAMPLES = [
  ["slippery floor", "both words, in names, ids, notes or tags"],
  ["tag = gait and state = COMPLETED", "and, or, not and parentheses combine conditions"],
  ["strategy in (random, informative)", "one of several; also not in"],
  ["fitness > 0.5 and created > -7d", "also best_fitness, iterations, repetitions, started, ended; a date is 2026-11-05"],
  ["note ~ \"slippery\"", "~ contains, !~ does not; also name, experiment, robot, engine, reality, optimizer"],
  ["state != COMPLETED and experiment_state = FAILED", "a study has a state, and so has each of its experiments"],
  ["archived = true", "archived ones, which are left out otherwise"],
];

/**
 * Return the chips of the saved views, with a button that saves the present filters as one.
 * @param {() => Filters} filters the present ones
 * @param {AbortSignal} signal
 * @returns {Page.Updatable}
 */
export function savedViews(filters, signal) {
  /** @type {Api.ViewRead[]} */
  let views = [];
  const chips = h("span", { class: "chips" });
  const reload = async () => {
    views = await get("/views", {}, signal);
    update();
  };
  const save = button("Save as a view…", () => { askForName(filters(), reload, signal); });
  const update = () => {
    const present = filters();
    save.hidden = !present.q;
    const archived = chip("Archived", { q: "archived = true" }, present);
    chips.replaceChildren(...views.map((view) => h("span", { class: "chip-with" }, chip(view.name, { q: view.query ?? "", sort: view.sort }, present), deleting(view, reload, signal))), archived);
  };
  update();
  reload().catch((error) => console.warn(error.message));
  return { element: h("div", { class: "views", role: "group", "aria-label": "Saved views" }, chips, save, help()), update };
}

/** @param {string} name @param {Partial<Filters>} wanted @param {Filters} present */
function chip(name, wanted, present) {
  const href = addressOf(wanted);
  return h("a", { class: "chip", href, "aria-current": href === addressOf(present) ? "true" : null }, name);
}

/** @param {Api.ViewRead} view @param {() => Promise<void>} reload @param {AbortSignal} signal */
function deleting({ name, query }, reload, signal) {
  const ask = () => openDialog({
    title: "Delete this view?",
    text: `“${name}” lists ${query || "everything"}. All users of the service lose the view; nothing that it lists is touched.`,
    action: "Delete it", danger: true,
    act: async () => {
      await remove(`/views/${encodeURIComponent(name)}`);
      await reload();
    },
  }, signal);
  return h("button", { type: "button", class: "chip-delete", "aria-label": `Delete the view ${name}`, onclick: ask }, "×");
}

/** @param {Filters} filters @param {() => Promise<void>} reload @param {AbortSignal} signal */
function askForName({ q, sort }, reload, signal) {
  openDialog({
    title: "Save as a view",
    text: `All users of the service see it. It lists ${q}; the choices of state and strategy are not part of it.`,
    fields: [{ name: "name", label: "Name", value: "", required: true, maxlength: 60, autocomplete: "off", hint: "the view that has this name is replaced" }],
    action: "Save",
    act: async ({ name }) => {
      await put(`/views/${encodeURIComponent(name.trim())}`, { query: q, sort });
      await reload();
    },
  }, signal);
}

function help() {
  const items = EXAMPLES.flatMap(([query, meaning]) => [
    h("dt", {}, h("a", { href: `#/?${new URLSearchParams({ q: query })}` }, h("code", {}, query))), h("dd", {}, meaning)]);
  return h("details", { class: "query-help" }, h("summary", {}, "How to search"), h("dl", {}, ...items));
}
