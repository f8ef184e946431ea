// @ts-check
/** Rows that stay the same elements while their content changes: focus and selected text survive. */

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
