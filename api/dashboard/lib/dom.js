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
