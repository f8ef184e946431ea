// @ts-check
/** The list of studies, live: to find them, to open them, and to choose experiments for a comparison. */

import { get } from "../lib/api.js";
import { h, keyedRows, setText } from "../lib/dom.js";
import { every, follow } from "../lib/live.js";
import { empty, failed, loading } from "../lib/placeholders.js";
import { unitsOf } from "../lib/robots.js";
import { addressOf, filterForm, filtersOf, isFiltered } from "./list/filters.js";
import { isSeveral, listRow, listTable } from "./list/rows.js";
import { savedViews } from "./list/saved_views.js";
import { selectionBar } from "./list/selection.js";
import { welcome } from "./list/welcome.js";

const AT_FIRST = 20;
const MOST = 500;
const MINUTE_MS = 60_000;

/** @typedef {import("./list/filters.js").Filters} Filters */
/** @typedef {import("./list/rows.js").Row} Row */
/** @typedef {{ filters: Filters, items: Api.StudyRead[], cursor: string | null }} Loaded the list of some filters so far, and the cursor of its next part */

/**
 * Fill `root` with the list that the parameters ask for, until `signal`.
 * @param {HTMLElement} root
 * @param {URLSearchParams} parameters
 * @param {AbortSignal} signal
 */
export async function show(root, parameters, signal) {
  const catalogue = /** @type {Api.Catalogue} */ (await get("/catalogue", {}, signal));
  const filters = filtersOf(parameters);
  const sorted = (/** @type {string} */ sort) => {
    filters.sort = sort;
    form.update();
    changed(filters);
  };
  const list = new List(signal, unitsOf(catalogue), { ...filters }, sorted);
  const changed = async (/** @type {Filters} */ wanted) => {
    if (signal.aborted) return;  // words typed just before the reader left would change the address of another view
    history.replaceState(null, "", addressOf(wanted));
    const loaded = list.change({ ...wanted });
    views.update();
    await loaded;
  };
  const form = filterForm(filters, catalogue.strategies.map(({ name }) => name), changed);
  const title = h("div", { class: "titled" }, h("h1", {}, "Studies"), h("a", { class: "button", href: "#/new" }, "New study"));
  const views = savedViews(() => list.filters, signal);
  root.replaceChildren(title, form.element, views.element, list.element);
  await changed(filters);
  if (signal.aborted) return;
  follow({}, () => list.refresh(), signal);
  every(MINUTE_MS, () => list.draw(), signal);
}

/**
 * Return the items of the former list that follow its reloaded first part, whatever came, went or moved meanwhile.
 *
 * @template {{ id: string }} Item
 * @param {Item[]} firstPart
 * @param {Item[]} former
 */
export function restOfList(firstPart, former) {
  const places = new Map(former.map(({ id }, index) => [id, index]));
  const last = firstPart.findLast(({ id }) => places.has(id));
  if (!last) return [];
  const shown = new Set(firstPart.map(({ id }) => id));
  return former.slice(/** @type {number} */ (places.get(last.id)) + 1).filter(({ id }) => !shown.has(id));
}

/** The table, with as many rows as the reader asked for. */
export class List {
  /**
   * @param {AbortSignal} signal
   * @param {(experiment: Api.ExperimentRead | undefined) => string} unit
   * @param {Filters} filters
   * @param {(order: string) => void} [sorted] called with the order that the head of a column asks for
   */
  constructor(signal, unit, filters, sorted = () => {}) {
    this.signal = signal;
    this.unit = unit;
    this.filters = filters;
    /** @type {Set<string>} */
    this.unfolded = new Set();
    /** @type {Loaded} */
    this.loaded = { filters, items: [], cursor: null };
    this.wanted = this.loaded;  // what is loaded next
    /** @type {Promise<unknown>} */
    this.turn = Promise.resolve();
    /** @type {HTMLElement | null} */
    this.error = null;
    /** @type {HTMLElement | null} */
    this.welcome = null;
    const { element, body, showOrder } = listTable("Studies", { sorted });
    this.table = element;
    this.showOrder = showOrder;
    this.fill = keyedRows(body, (/** @type {Row} */ { value, isNested }) => `${value.id} ${isNested ? "nested" : isSeveral(value)}`, (row) => listRow(row, this));
    this.more = h("button", { type: "button", class: "quiet more", onclick: () => { this.lengthen(); } }, "Show more");
    this.bar = selectionBar(() => { this.refresh().catch(() => this.draw()); }, signal);
    this.note = h("div", {}, loading());
    this.mistake = h("p", { class: "mistake", role: "status" });
    this.element = h("div", {}, this.mistake, this.bar.element, this.table, this.note, this.more);
    this.ticked = () => this.draw();
  }

  /** Show the list of other filters; an error replaces the former list. @param {Filters} filters */
  async change(filters) {
    this.filters = filters;
    this.wanted = { filters, items: [], cursor: null };
    this.turn = Promise.resolve();  // nobody waits any more for what the former filters asked for
    try {
      await this.refresh();
    } catch (error) {
      if (filters !== this.filters || this.signal.aborted) return;
      this.loaded = this.wanted;
      this.fail(error, () => this.change({ ...filters }));
    }
  }

  /** Load the list again: its first part, since the rest stays as it is. */
  refresh() {
    return this.inTurn(async (isReplaced) => {
      const { wanted } = this;
      const limit = Math.min(MOST, Math.max(AT_FIRST, wanted.items.length));
      try {
        const { items, next } = await get("/studies", { ...wanted.filters, limit }, this.signal);
        if (isReplaced()) return;
        if (wanted !== this.loaded) setText(this.mistake, "");
        if (wanted !== this.loaded || !wanted.items.length) this.error = null;
        const rest = wanted.items.length > limit ? restOfList(items, wanted.items) : [];
        this.loaded = { ...wanted, items: [...items, ...rest], cursor: rest.length ? wanted.cursor : next };
      } catch (error) {
        if (isReplaced()) return;
        if (error.errors?.[0]?.pointer !== "q") throw error;
        setText(this.mistake, error.errors[0].message);  // half a query: the former list stays until it is whole
      }
      this.wanted = this.loaded;
      this.draw();
    });
  }

  /**
   * Load after what is being loaded: a longer and a newer list would undo each other. Other filters leave it out.
   * @param {(isReplaced: () => boolean) => Promise<void>} load
   */
  inTurn(load) {
    const { filters } = this;
    const isReplaced = () => filters !== this.filters || this.signal.aborted;
    const loaded = this.turn.catch(() => {}).then(() => (isReplaced() ? undefined : load(isReplaced)));
    this.turn = loaded;
    return loaded;
  }

  /** Load the next part of the list; an error stands below it. */
  async lengthen() {
    this.more.disabled = true;
    await this.inTurn(async (isReplaced) => {
      this.error = null;
      const { filters, items, cursor } = this.loaded;
      try {
        const part = await get("/studies", { ...filters, limit: AT_FIRST * 2, cursor }, this.signal);
        if (isReplaced()) return;
        this.loaded = { filters, items: [...items, ...part.items], cursor: part.next };
        this.wanted = this.loaded;
        this.draw();
      } catch (error) {
        if (!isReplaced()) this.fail(error, () => this.lengthen());
      }
    });
    this.more.disabled = false;
  }

  /** @param {unknown} error @param {() => void} retry */
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
    const { items, cursor } = this.loaded;
    const below = (/** @type {Api.StudyRead} */ study) =>
      (isSeveral(study) && this.unfolded.has(study.id) ? study.experiments.map((value) => ({ value, isNested: true })) : []);
    this.fill(items.flatMap((value) => [{ value }, ...below(value)]));
    this.showOrder(this.loaded.filters.sort);
    this.bar.update();
    this.table.hidden = !items.length;
    this.more.hidden = !cursor;
    const note = this.error ?? (items.length || this.mistake.textContent ? null : this.nothing());
    if (!note || note !== this.note.firstChild) this.note.replaceChildren(...(note ? [note] : []));
  }

  nothing() {
    if (!isFiltered(this.filters)) return (this.welcome ??= welcome());
    const again = () => dispatchEvent(new HashChangeEvent("hashchange"));  // also where the address is the same already
    return empty("Nothing fits these filters.", h("a", { class: "button quiet", href: "#/", onclick: again }, "Show everything"));
  }
}
