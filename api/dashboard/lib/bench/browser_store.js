// @ts-check
/** Values that this browser keeps for the bench, also after a reload; without permission to keep them, while the page is open. */

/** @typedef {Pick<Storage, "getItem" | "setItem" | "removeItem" | "key" | "length">} Kept */

/**
 * Return a store of values of one kind. Services below different prefixes of a host have stores of their own.
 *
 * @param {string} kind
 * @param {Kept} [kept]
 * @param {string} [place] path of the service
 */
export function browserStore(kind, kept = localStorage, place = globalThis.location?.pathname ?? "/") {
  const prefix = `gaplab-bench ${place} ${kind} `;
  /** @type {Map<string, unknown>} */
  const here = new Map();  // what could not be kept

  const keptNames = () => Array.from({ length: kept.length }, (_, index) => kept.key(index) ?? "")
    .filter((name) => name.startsWith(prefix)).map((name) => name.slice(prefix.length));

  return {
    names: () => [...new Set([...keptNames(), ...here.keys()])],
    /** Whether everything outlives a reload. */
    isKept: () => !here.size,
    /**
     * @param {string} name
     * @returns {any} null if there is none
     */
    read(name) {
      if (here.has(name)) return here.get(name);
      try {
        return JSON.parse(kept.getItem(prefix + name) ?? "null");
      } catch {
        return null;  // half-written, or of another version
      }
    },
    /**
     * @param {string} name
     * @param {unknown} value
     */
    write(name, value) {
      here.delete(name);
      try {
        kept.setItem(prefix + name, JSON.stringify(value));
      } catch {
        here.set(name, value);  // the store is full, or switched off
      }
    },
    /** @param {string} name */
    remove(name) {
      here.delete(name);
      kept.removeItem(prefix + name);
    },
  };
}
