/** Elements made in one expression; text is always text, never markup. */

/**
 * An element: `h("a", { href: "#/" , class: "quiet", onclick: go }, "text", child)`.
 * Attributes that are null or false are left out, true ones are bare; `on…` are listeners; `dataset` and `style` are objects.
 */
export function h(tag, attributes = {}, ...children) {
  const element = document.createElement(tag);
  for (const [name, value] of Object.entries(attributes ?? {})) {
    if (value === null || value === undefined || value === false) continue;
    if (name.startsWith("on")) element.addEventListener(name.slice(2), value);
    else if (name === "dataset" || name === "style") Object.assign(element[name], value);
    else element.setAttribute(name, value === true ? "" : value);
  }
  element.append(...children.flat(Infinity).filter((each) => each !== null && each !== undefined && each !== false));
  return element;
}

/** Put `children` in place of what the element has, unless nothing changed since the last time (`key`). */
export function refill(element, key, make) {
  if (element.dataset.key === key) return;
  element.dataset.key = key;
  element.replaceChildren(...[make()].flat(Infinity));
}
