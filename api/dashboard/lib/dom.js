// @ts-check
/** Elements made in one expression; text is always text, never markup. */

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

/**
 * Return the element that index.html has under an id.
 *
 * @param {string} id
 */
export const byId = (id) => /** @type {HTMLElement} */ (document.getElementById(id));

/**
 * Set an element's text, unless it has it already: a screen reader repeats what is set.
 *
 * @param {Element} element
 * @param {string} text
 */
export function setText(element, text) {
  if (element.textContent !== text) element.textContent = text;
}

/**
 * Replace the content of an element, unless `key` is the same as at the last call.
 *
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
 *
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
