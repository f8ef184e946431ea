/** A long list is asked for anew only in its first part: the rest stays, and the two must meet. */

/** What of a `former` list follows the `page` that its first part is now, whatever has come, gone or moved meanwhile. */
export function following(page, former) {
  const places = new Map(former.map((each, at) => [each.id, at]));
  const last = page.findLast((each) => places.has(each.id));
  if (!last) return [];
  const shown = new Set(page.map((each) => each.id));
  return former.slice(places.get(last.id) + 1).filter((each) => !shown.has(each.id));
}
