// @ts-check
/** Answers of this browser: each is kept until the service has acknowledged it, and is sent under one idempotency key. */

import { newKey } from "../keyed.js";
import { browserStore } from "./browser_store.js";

const SENT_KEPT = 10;  // the latest answers can be undone

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

/**
 * Return whether an error leaves open whether the service has the answer, or will take it later.
 *
 * @param {{ status?: number }} error
 */
export const isTemporary = ({ status = 0 }) => status < 400 || status >= 500 || [401, 403, 408, 425, 429].includes(status);

/**
 * Return the answers that a store keeps. Each is an item of its own, so that two tabs overwrite nothing of each other.
 *
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

  /**
   * Send an answer, and return whether that is over.
   *
   * @param {Entry} entry
   */
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
