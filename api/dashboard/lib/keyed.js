// @ts-check
/** Idempotency keys: what is sent twice under one key is done once. */

import { post } from "./api.js";
import { stringify } from "./json.js";

/** Return a new idempotency key; `crypto.randomUUID` exists on loopback and HTTPS only. */
export const newKey = () => Array.from(crypto.getRandomValues(new Uint32Array(4)), (part) => part.toString(16).padStart(8, "0")).join("");

/**
 * Return a function that posts, under the same key for the same body: a second press after a lost answer does nothing twice.
 * It may add a query to the path.
 *
 * @param {string} path
 */
export function keyed(path) {
  let last = { text: "", key: "" };
  return (/** @type {unknown} */ body, query = "") => {
    const text = stringify(body);
    if (last.text !== text) last = { text, key: newKey() };
    return post(path + query, body, { "Idempotency-Key": last.key });
  };
}
