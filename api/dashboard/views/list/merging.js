// @ts-check
/** A long list is reloaded only in its first part: the rest stays, and the two parts must meet. */

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
