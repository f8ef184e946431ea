// @ts-check
/** Elements made in one expression; text is always text, never markup. What changes keeps its elements, the focus and selected text. */

/**
 * Build an element: `h("a", { href: "#/", class: "quiet", onclick: go }, "text", child)`.
 *
 * An attribute that is null or false is left out, and one that is true has no value. Functions listen to events.
 *
 * @template {keyof HTMLElementTagNameMap} Tag
 * @param {Tag} tag
 * @param {Page.Attributes} [attributes]
 * @param {...Page.Child} children
 * @returns {HTMLElementTagNameMap[Tag]}
 */
export function h(tag, attributes = {}, ...children) {
  const element = document.createElement(tag);
  for (const [name, value] of Object.entries(attributes)) {
    if (value === null || value === undefined || value === false) continue;
    if (typeof value === "function") element.addEventListener(name.slice(2), /** @type {EventListener} */ (value));
    else if (name === "dataset") Object.assign(element.dataset, value);
    else element.setAttribute(name, value === true ? "" : String(value));
  }
  element.append(...contents(children));
  return element;
}

/** @param {Page.Child[]} children */
function contents(children) {
  const flat = /** @type {any[]} */ (children).flat(Infinity);
  return /** @type {(Node | string)[]} */ (flat.filter((child) => child !== null && child !== undefined && child !== false));
}

/** Return the element that index.html has under an id. @param {string} id */
export const byId = (id) => /** @type {HTMLElement} */ (document.getElementById(id));

/** Set an element's text, unless it has it already: a screen reader repeats what is set. @param {Element} element @param {string} text */
export function setText(element, text) {
  if (element.textContent !== text) element.textContent = text;
}

/**
 * Replace the content of an element, unless `key` is the same as at the last call.
 * @param {HTMLElement} element
 * @param {string} key
 * @param {() => Page.Child} make
 */
export function refill(element, key, make) {
  if (element.dataset.key === key) return;
  element.dataset.key = key;
  element.replaceChildren(...contents([make()]));
}

/**
 * Replace the content of an element as `refill` does. The focus stays, on what has the same label or text, and what the reader
 * unfolded stays unfolded, by the ids in the data of `details`.
 * @param {HTMLElement} element
 * @param {string} key
 * @param {() => Page.Child} make
 */
export function refillInPlace(element, key, make) {
  const { activeElement } = document;
  const unfolded = [...element.querySelectorAll("details")].filter(({ open }) => open).map(({ dataset }) => dataset.id);
  const focused = activeElement && element.contains(activeElement) ? labelOf(activeElement) : null;
  refill(element, key, make);
  for (const details of element.querySelectorAll("details")) details.open ||= Boolean(details.dataset.id) && unfolded.includes(details.dataset.id);
  if (focused === null || element.contains(document.activeElement)) return;
  const focusable = /** @type {HTMLElement[]} */ ([...element.querySelectorAll("a, button, input, select, summary, [tabindex]")]);
  focusable.find((other) => labelOf(other) === focused)?.focus();
}

/** @param {Element} element */
const labelOf = (element) => element.getAttribute("aria-label") ?? element.textContent;

/** Return a small button. @param {Page.Child} label @param {() => unknown} onclick @param {Page.Attributes} [attributes] */
export const button = (label, onclick, attributes = {}) => h("button", { type: "button", class: "quiet small", onclick, ...attributes }, label);

/** Return a list to choose from. @param {Page.Choices} choices @param {Page.Attributes} [attributes] */
export const select = (choices, attributes = {}) =>
  h("select", attributes, ...choices.map(([value, label, disabled]) => h("option", { value, disabled }, label)));

/** Return a function that makes handlers, whose errors are shown in an element. @param {HTMLElement} place */
export const tellingErrors = (place) => (/** @type {() => unknown} */ act) => async () => {
  place.textContent = "";
  try {
    await act();
  } catch (error) {
    place.textContent = error.message;
  }
};

/**
 * Return a function that shows items as the children of `body`, one element each.
 *
 * A key that is new gets an element from `make`; every item shown updates its element. Only what changed its place is moved.
 *
 * @template Item
 * @param {Element} body
 * @param {(item: Item) => string} keyOf
 * @param {(item: Item) => Page.Updatable<Item>} make
 */
export function keyedRows(body, keyOf, make) {
  /** @type {Map<string, Page.Updatable<Item>>} */
  const rows = new Map();
  return (/** @type {Item[]} */ items) => {
    const wanted = new Set(items.map(keyOf));
    for (const [key, row] of rows) {
      if (wanted.has(key)) continue;
      row.element.remove();
      rows.delete(key);
    }
    items.forEach((item, index) => {
      const row = rows.get(keyOf(item)) ?? make(item);
      rows.set(keyOf(item), row);
      row.update(item);
      if (body.children[index] !== row.element) body.insertBefore(row.element, body.children[index] ?? null);
    });
  };
}
