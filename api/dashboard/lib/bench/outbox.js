// @ts-check
/**
 * What this browser keeps for the bench, also after a reload; without permission to keep it, while the page is open. Answers are kept until
 * the service has acknowledged them, and each is sent under one idempotency key.
 */

import { newKey } from "../api.js";

const SENT_KEPT = 10;  // the latest answers can be undone

/** @typedef {Pick<Storage, "getItem" | "setItem" | "removeItem" | "key" | "length">} Kept */

/**
 * Return a store of values of one kind. Services below different prefixes of a host have stores of their own.
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
    /** @param {string} name @returns {any} null if there is none */
    read(name) {
      if (here.has(name)) return here.get(name);
      try {
        return JSON.parse(kept.getItem(prefix + name) ?? "null");
      } catch {
        return null;  // half-written, or of another version
      }
    },
    /** @param {string} name @param {unknown} value */
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

/**
 * @typedef {object} Entry an answer of this browser
 * @property {string} key idempotency key
 * @property {string} request id
 * @property {string} words which measurement it is
 * @property {number} repeats that the request asks for
 * @property {Record<string, any>} body
 * @property {number} made when it was given, in milliseconds
 * @property {"waiting" | "sent" | "refused"} state
 * @property {string} [message] why it is not sent, or was refused
 * @property {Api.AnswerRead} [answer] what the service stored
 */

/** @typedef {{ list: () => Entry[], add: (entry: Pick<Entry, "request" | "words" | "repeats" | "body">) => Entry, flush: () => Promise<boolean>, forget: (key: string) => void }} Outbox */

/** Return whether an error leaves open whether the service has the answer, or will take it later. @param {{ status?: number }} error */
export const isTemporary = ({ status = 0 }) => status < 400 || status >= 500 || [401, 403, 408, 425, 429].includes(status);

/**
 * Return the answers that a store keeps. Each is an item of its own, so that two tabs overwrite nothing of each other.
 * @param {(entry: Entry) => Promise<Api.AnswerRead>} send
 * @param {() => void} changed called after each change
 * @param {Pick<ReturnType<typeof browserStore>, "names" | "read" | "write" | "remove">} [store]
 * @returns {Outbox}
 */
export function outbox(send, changed, store = browserStore("answer")) {
  /** @type {Promise<boolean> | null} */
  let flushing = null;
  const list = () => store.names().flatMap((name) => {
    const entry = /** @type {Entry | null} */ (store.read(name));
    return entry ? [entry] : [];
  }).sort((a, b) => a.made - b.made);

  /** @param {Entry} entry an entry that was forgotten meanwhile, by another tab, stays so */
  const update = (entry) => {
    if (store.read(entry.key)) store.write(entry.key, entry);
    changed();
  };

  /** Send an answer, and return whether that is over. @param {Entry} entry */
  async function deliver(entry) {
    try {
      const answer = await send(entry);
      update({ ...entry, state: "sent", answer, message: undefined });
    } catch (error) {
      const isWaiting = isTemporary(error);
      update({ ...entry, state: isWaiting ? "waiting" : "refused", message: error.status ? error.message : "the service does not answer" });
      return !isWaiting;
    }
    return true;
  }

  /** Send the oldest first, until one must wait. */
  async function sendAll() {
    const next = () => list().find(({ state }) => state === "waiting");  // more may come while others are sent
    for (let entry = next(); entry; entry = next()) {
      if (!(await deliver(entry))) return false;
    }
    for (const { key } of list().filter(({ state }) => state === "sent").slice(0, -SENT_KEPT)) store.remove(key);
    return true;
  }

  return {
    list,
    add(given) {
      const entry = { ...given, key: newKey(), made: Date.now(), state: /** @type {const} */ ("waiting") };
      store.write(entry.key, entry);
      changed();
      return entry;
    },
    /** Send what waits; return whether nothing waits any more. */
    flush() {
      flushing ??= sendAll().finally(() => { flushing = null; });
      return flushing;
    },
    forget(key) {
      store.remove(key);
      changed();
    },
  };
}
