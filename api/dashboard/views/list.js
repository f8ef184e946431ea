// @ts-check
/** The list of studies and experiments, live: to find them, to open them, and to choose some for a comparison. */

import { get } from "../lib/api.js";
import { h, setText } from "../lib/dom.js";
import { keyedRows } from "../lib/keyed_rows.js";
import { follow } from "../lib/live.js";
import { empty, failed, loading } from "../lib/placeholders.js";
import { unitsOf } from "../lib/robots.js";
import { addressOf, filterForm, filtersOf, isFiltered } from "./list/filters.js";
import { experimentRow, headCells, studyRow } from "./list/rows.js";
import { savedViews } from "./list/saved_views.js";
import { selectionBar } from "./list/selection.js";
import { lengthened, merged, refreshed, sourcesOf } from "./list/sources.js";

const AT_FIRST = 20;
const MOST = 500;
const MINUTE_MS = 60_000;

/** @typedef {import("./list/filters.js").Filters} Filters */
/** @typedef {Api.StudyRead | Api.ExperimentRead} Item */
/** @typedef {{ value: Item, isNested?: boolean }} Row */

/**
 * Fill `root` with the list that the parameters ask for, until `signal`.
 *
 * @param {HTMLElement} root
 * @param {URLSearchParams} parameters
 * @param {AbortSignal} signal
 */
export async function show(root, parameters, signal) {
  const catalogue = /** @type {Api.Catalogue} */ (await get("/catalogue", {}, signal));
  const list = new List(signal, unitsOf(catalogue), filtersOf(parameters));
  const strategies = catalogue.strategies.map(({ name }) => name);
  const place = h("div");
  const makeForm = () => place.replaceChildren(filterForm({ ...list.filters }, strategies, changed));
  const changed = async (/** @type {Filters} */ filters) => {
    if (signal.aborted) return;  // words typed just before the reader left would change the address of another view
    history.replaceState(null, "", addressOf(filters));
    const loaded = list.change({ ...filters });
    views.update();
    if (filters.show !== shown) {
      const focused = place.querySelector(":focus")?.textContent;
      makeForm();
      [...place.querySelectorAll("button")].find((button) => button.textContent === focused)?.focus();
    }
    shown = filters.show;
    await loaded;
  };
  let shown = list.filters.show;
  makeForm();
  const title = h("div", { class: "titled" }, h("h1", {}, "Studies and experiments"), h("a", { class: "button", href: "#/new" }, "New study"));
  const views = savedViews(() => list.filters, signal);
  root.replaceChildren(title, place, views.element, list.element);
  await changed(list.filters);
  if (signal.aborted) return;
  follow({}, () => list.refresh(), signal);
  const timer = setInterval(() => list.draw(), MINUTE_MS);
  signal.addEventListener("abort", () => clearInterval(timer));
}

/** The table, with as many rows as the reader asked for. */
export class List {
  /**
   * @param {AbortSignal} signal
   * @param {(experiment: Api.ExperimentRead | undefined) => string} unit
   * @param {Filters} filters
   */
  constructor(signal, unit, filters) {
    this.signal = signal;
    this.unit = unit;
    this.filters = filters;
    /** @type {Set<string>} */
    this.unfolded = new Set();
    /** @type {import("./list/sources.js").Source[]} */
    this.sources = sourcesOf(filters);
    this.wanted = this.sources;  // what is loaded next
    /** @type {Promise<unknown>} */
    this.turn = Promise.resolve();
    /** @type {HTMLElement | null} */
    this.error = null;
    const body = h("tbody");
    this.fill = keyedRows(body, (/** @type {Row} */ { value, isNested }) => `${value.id} ${isNested ?? ""}`, (row) => this.makeRow(row));
    this.table = h("table", { class: "list" }, h("caption", { class: "away" }, "Studies and experiments"), h("thead", {}, h("tr", {}, ...headCells())), body);
    this.more = h("button", { type: "button", class: "quiet more", onclick: () => { this.lengthen(); } }, "Show more");
    this.bar = selectionBar(() => this.draw());
    this.note = h("div", {}, loading());
    this.mistake = h("p", { class: "mistake", role: "status" });
    this.element = h("div", {}, this.mistake, this.bar.element, this.table, this.note, this.more);
    this.ticked = () => {
      this.bar.update();
      this.draw();
    };
  }

  /**
   * @param {Row} row
   * @returns {Page.Updatable<any>}
   */
  makeRow({ value, isNested }) {
    return "experiments" in value ? studyRow(value, this) : experimentRow({ value, isNested }, this);
  }

  /**
   * Show the list of other filters; an error replaces the former list.
   *
   * @param {Filters} filters
   */
  async change(filters) {
    this.filters = filters;
    this.wanted = sourcesOf(filters);
    this.turn = Promise.resolve();  // nobody waits any more for what the former filters asked for
    try {
      await this.refresh();
    } catch (error) {
      if (filters !== this.filters || this.signal.aborted) return;
      this.sources = this.wanted;
      this.fail(error, () => this.change({ ...filters }));
    }
  }

  /** Load the list again, as long as it is. */
  refresh() {
    return this.inTurn(async (isReplaced) => {
      const { wanted } = this;
      const limit = (/** @type {{ items: Item[] }} */ { items }) => Math.min(MOST, Math.max(AT_FIRST, items.length));
      try {
        const sources = await Promise.all(wanted.map((source) => refreshed(source, limit(source), this.signal)));
        if (isReplaced()) return;
        if (wanted !== this.sources) setText(this.mistake, "");
        if (wanted !== this.sources || !this.shown().items.length) this.error = null;
        this.sources = sources;
      } catch (error) {
        if (isReplaced()) return;
        if (error.errors?.[0]?.pointer !== "q") throw error;
        setText(this.mistake, error.errors[0].message);  // half a query: the former list stays until it is whole
      }
      this.wanted = this.sources;
      this.draw();
    });
  }

  /**
   * Load after what is being loaded: a longer and a newer list would undo each other. Other filters leave it out.
   *
   * @param {(isReplaced: () => boolean) => Promise<void>} load
   */
  inTurn(load) {
    const { filters } = this;
    const isReplaced = () => filters !== this.filters || this.signal.aborted;
    const loaded = this.turn.catch(() => {}).then(() => (isReplaced() ? undefined : load(isReplaced)));
    this.turn = loaded;
    return loaded;
  }

  /** Return the items so far, and the sources whose next part must be loaded for more. */
  shown() {
    return merged(this.sources, this.filters.sort);
  }

  /** Load the next part of the list; an error stands below it. */
  async lengthen() {
    this.more.disabled = true;
    await this.inTurn(async (isReplaced) => {
      this.error = null;
      try {
        const longer = await Promise.all(this.shown().ending.map((source) => lengthened(source, AT_FIRST * 2, this.signal)));
        if (isReplaced()) return;
        this.sources = this.sources.map((source) => longer.find(({ path }) => path === source.path) ?? source);
        this.wanted = this.sources;
        this.draw();
      } catch (error) {
        if (!isReplaced()) this.fail(error, () => this.lengthen());
      }
    });
    this.more.disabled = false;
  }

  /**
   * @param {unknown} error
   * @param {() => void} retry
   */
  fail(error, retry) {
    this.error = failed(error, retry, "h2");
    this.draw();
  }

  /** @param {string} id of a study */
  toggle(id) {
    if (!this.unfolded.delete(id)) this.unfolded.add(id);
    this.draw();
  }

  draw() {
    const below = (/** @type {Item} */ value) =>
      ("experiments" in value && this.unfolded.has(value.id) ? value.experiments.map((experiment) => ({ value: experiment, isNested: true })) : []);
    const { items, ending } = this.shown();
    const rows = items.flatMap((value) => [{ value }, ...below(value)]);
    this.fill(rows);
    this.table.hidden = !rows.length;
    this.more.hidden = !ending.length;
    const note = this.error ?? (rows.length || this.mistake.textContent ? null : this.nothing());
    if (!note || note !== this.note.firstChild) this.note.replaceChildren(...(note ? [note] : []));
  }

  nothing() {
    if (isFiltered(this.filters)) {
      const again = () => dispatchEvent(new HashChangeEvent("hashchange"));  // also where the address is the same already
      return empty("Nothing fits these filters.", h("a", { class: "button quiet", href: "#/", onclick: again }, "Show everything"));
    }
    const what = this.filters.show === "studies" ? "There are no studies yet." : "Nothing was submitted yet.";
    return empty(what, h("a", { class: "button", href: "#/new" }, "Submit a study"));
  }
}
