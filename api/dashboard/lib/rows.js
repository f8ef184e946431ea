/** Rows that stay the same elements while what they show changes: focus and a text that is being selected survive. */

/**
 * A function that shows `items` as children of `body`, one element each: `make(item)` gives `{ element, update(item) }` for a
 * key that is new, `update` is called whenever the item is shown, and only what changed its place is moved.
 */
export function rows(body, keyOf, make) {
  const kept = new Map();
  return (items) => {
    const keys = items.map(keyOf);
    const wanted = new Set(keys);
    for (const [key, row] of kept) {
      if (wanted.has(key)) continue;
      row.element.remove();
      kept.delete(key);
    }
    items.forEach((item, at) => {
      if (!kept.has(keys[at])) kept.set(keys[at], make(item));
      const row = kept.get(keys[at]);
      row.update(item);
      if (body.children[at] !== row.element) body.insertBefore(row.element, body.children[at] ?? null);
    });
  };
}

/** Set an element's text, if it is another. */
export function say(element, text) {
  if (element.textContent !== text) element.textContent = text;
}
