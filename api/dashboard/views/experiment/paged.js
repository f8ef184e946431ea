// @ts-check
/** A list that is shown page by page, with its filters above and the way to its other pages below. */

import { get } from "../../lib/api.js";
import { h, refillInPlace } from "../../lib/dom.js";

/**
 * Return the filters, the place of the list, and the buttons that turn its pages.
 *
 * @param {Page.ExperimentPage} page
 * @param {object} list
 * @param {string} list.path
 * @param {HTMLElement} list.filters a change in it shows the first page
 * @param {() => Page.Query} list.query what the filters ask for
 * @param {number} list.size of a page
 * @param {string[]} list.kinds of events that change it
 * @param {(items: any[], isFirst: boolean) => Page.Child[]} list.render
 */
export function pagedList(page, { path, filters, query, size, kinds, render }) {
  const place = h("div");
  /** @type {(string | null)[]} */
  let cursors = [null];  // of this page and of those before it
  /** @type {string | null} */
  let next = null;
  let requests = 0;
  let isTurning = false;
  const load = async () => {
    const request = ++requests;
    const loaded = await get(path, { limit: size, cursor: cursors.at(-1), ...query() }, page.signal);
    if (request !== requests) return;  // a later request has replaced this one
    next = loaded.next;
    refillInPlace(place, JSON.stringify([loaded.items, query()]), () => render(loaded.items, cursors.length === 1));
    back.disabled = cursors.length < 2;
    forward.disabled = !next;
    status.textContent = `Page ${cursors.length}`;
  };
  const showError = (/** @type {Error} */ error) => { status.textContent = error.message; };
  const turnTo = async (/** @type {(string | null)[]} */ newCursors) => {
    if (isTurning) return;
    const before = cursors;
    isTurning = true;
    cursors = newCursors;
    try {
      await load();
    } catch (error) {
      if (cursors === newCursors) cursors = before;
      showError(error);
    }
    isTurning = false;
  };
  const filter = () => {
    cursors = [null];
    load().catch(showError);
  };
  const back = h("button", { type: "button", class: "quiet small", disabled: true, onclick: () => turnTo(cursors.slice(0, -1)) }, "Previous");
  const forward = h("button", { type: "button", class: "quiet small", disabled: true, onclick: () => turnTo([...cursors, next]) }, "Next");
  const status = h("span", { role: "status" });
  filters.addEventListener("change", filter);
  page.sections.add(place, kinds, load);
  return [filters, place, h("p", { class: "pages" }, back, status, forward)];
}
