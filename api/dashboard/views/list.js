/** Studies and experiments: how each is, live, to be found, opened and compared. */

import { get } from "../lib/api.js";
import { h } from "../lib/dom.js";
import { follow } from "../lib/live.js";
import { rows } from "../lib/rows.js";
import { empty, failed, loading } from "../lib/states.js";
import { addressOf, filters, isFiltered, wantedBy } from "./list/filters.js";
import { experimentRow, heads, studyRow } from "./list/rows.js";
import { following } from "./list/seam.js";
import { selectionBar } from "./list/selection.js";

const AT_ONCE = 20;
const MOST = 500;
const MINUTE_MS = 60_000;

/** Fill `root` with the list that `parameters` ask for, until `signal`. */
export async function show(root, parameters, signal) {
  const catalogue = await get("/catalogue", {}, signal);
  const units = Object.fromEntries(catalogue.robots.map((each) => [each.name, each.details.unit]));
  const list = new List(signal, (experiment) => units[experiment?.spec.robot.name] ?? "");
  const strategies = catalogue.strategies.map((each) => each.name);
  const place = h("div");
  const changed = async (wanted) => {
    if (signal.aborted) return;  // what was typed just before one left would change the address of another view
    history.replaceState(null, "", addressOf(wanted));
    const focused = place.querySelector(":focus")?.textContent;
    if (list.wanted?.show !== wanted.show) {
      place.replaceChildren(filters(wanted, strategies, changed));
      [...place.querySelectorAll("button")].find((each) => each.textContent === focused)?.focus();
    }
    await list.ask({ ...wanted });
  };
  const head = h("div", { class: "titled" }, h("h1", {}, "Studies and experiments"), h("a", { class: "button", href: "#/new" }, "New study"));
  root.replaceChildren(head, place, list.element);
  await changed(wantedBy(parameters));
  if (signal.aborted) return;
  follow({}, () => list.refresh(), signal);
  const clock = setInterval(() => list.draw(), MINUTE_MS);
  signal.addEventListener("abort", () => clearInterval(clock));
}

/** The table, as much of it as was asked for. */
class List {
  constructor(signal, unit) {
    Object.assign(this, { signal, unit, open: new Set(), items: [], next: null, wanted: null, turn: 0, trouble: null });
    const body = h("tbody");
    const make = (each) => (each.value.experiments ? studyRow(each, this) : experimentRow(each, this));
    this.fill = rows(body, (each) => `${each.value.id} ${each.nested ?? ""}`, make);
    this.table = h("table", { class: "list" }, h("caption", { class: "away" }, "Studies and experiments"), h("thead", {}, h("tr", {}, ...heads())), body);
    this.more = h("button", { type: "button", class: "quiet more", onclick: () => this.lengthen() }, "Show more");
    this.bar = selectionBar(() => this.draw());
    this.note = h("div", {}, loading());
    this.element = h("div", {}, this.bar.element, this.table, this.note, this.more);
    this.ticked = () => { this.bar.update(); this.draw(); };
  }

  /** Another list than before. If it does not come, that stands in place of the former one. */
  async ask(wanted) {
    Object.assign(this, { wanted, next: null });
    const coming = this.refresh(AT_ONCE, []);
    const { turn } = this;
    try {
      await coming;
    } catch (error) {
      if (turn !== this.turn || this.signal.aborted) return;
      this.items = [];
      this.fail(error, () => this.ask(wanted));
    }
  }

  /** The same list anew, as long as it is. */
  async refresh(limit = Math.min(MOST, Math.max(AT_ONCE, this.items.length)), former = null) {
    const turn = ++this.turn;
    const { show: kind, ...which } = this.wanted;
    const page = await get(`/${kind}`, { ...which, limit }, this.signal);
    if (turn !== this.turn || this.signal.aborted) return;
    const all = former ?? this.items;
    const rest = all.length > limit ? following(page.items, all) : [];
    if (former || !this.items.length) this.trouble = null;
    Object.assign(this, { items: [...page.items, ...rest], next: rest.length ? this.next : page.next });
    this.draw();
  }

  /** What follows. If it does not come, that is said below the list. */
  async lengthen() {
    const asked = this.wanted;
    const { show: kind, ...which } = asked;
    this.more.disabled = true;
    this.trouble = null;
    try {
      const page = await get(`/${kind}`, { ...which, limit: AT_ONCE * 2, cursor: this.next }, this.signal);
      if (asked !== this.wanted) return;  // another list has taken its place
      this.items.push(...page.items);
      this.next = page.next;
      this.draw();
    } catch (error) {
      if (asked === this.wanted && !this.signal.aborted) this.fail(error, () => this.lengthen());
    } finally {
      this.more.disabled = false;
    }
  }

  fail(error, again) {
    this.trouble = failed(error, again, "h2");
    this.draw();
  }

  toggle(id) {
    if (!this.open.delete(id)) this.open.add(id);
    this.draw();
  }

  draw() {
    const below = (value) => (this.open.has(value.id) ? value.experiments.map((each) => ({ value: each, nested: true })) : []);
    const shown = this.items.flatMap((value) => [{ value }, ...below(value)]);
    this.fill(shown);
    this.table.hidden = !shown.length;
    this.more.hidden = !this.next;
    const note = this.trouble ?? (shown.length ? null : this.nothing());
    if (!note || note !== this.note.firstChild) this.note.replaceChildren(...(note ? [note] : []));
  }

  nothing() {
    if (isFiltered(this.wanted)) {
      const again = () => dispatchEvent(new HashChangeEvent("hashchange"));  // also where the address is the same already
      return empty("Nothing here is like that.", h("a", { class: "button quiet", href: "#/", onclick: again }, "Show everything"));
    }
    return empty("Nothing was submitted yet.", h("a", { class: "button", href: "#/new" }, "Submit a study"));
  }
}
