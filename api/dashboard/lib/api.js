// @ts-check
/** Requests to the service, with the token of a guarded one, and the stream of its events. */

import { parse, stringify } from "./json.js";
import { abortWhenHidden, rest, untilVisible } from "./waiting.js";

const RECONNECT_MS = 1500;
const MOST_TRIES = 10;
const OVER = new Set([401, 403, 409]);  // statuses of a stream that cannot be resumed
const TOKEN = "gaplab-token";

/** Return the token, or null. It is kept while the tab is open, and sent to this service only. */
export const token = () => sessionStorage.getItem(TOKEN);

/** @param {string} secret */
export const keepToken = (secret) => sessionStorage.setItem(TOKEN, secret);

/** A problem that the service answered with; status 0 means that it did not answer. */
export class Problem extends Error {
  /** @param {Partial<Api.Problem> & { retry?: () => void, retryAfterS?: number }} problem */
  constructor({ status = 0, title = "The service does not answer", detail, errors, retry, retryAfterS = 0 }) {
    super(detail || title);
    this.status = status;
    this.retryAfterS = retryAfterS;
    this.title = title;
    this.errors = errors ?? [];
    this.retry = retry;
  }
}

/**
 * Return the JSON at a path.
 * @param {string} path
 * @param {Page.Query} [query] may hold lists; what is null or empty is left out
 * @param {AbortSignal} [signal]
 * @returns {Promise<any>}
 */
export const get = async (path, query = {}, signal = undefined) => (await requestPatiently(path + queryString(query), { signal })).json();

/** Return the JSON at a path, with its tag. @param {string} path @param {AbortSignal} [signal] */
export const getTagged = async (path, signal = undefined) => tagged(await request(path, { signal }));

/** Return the file at a path. @param {string} path @param {Page.Query} [query] */
export const getFile = async (path, query = {}) => (await requestPatiently(path + queryString(query), {})).blob();

/**
 * Send a POST, and return the JSON of the answer.
 * @param {string} path
 * @param {unknown} [body]
 * @param {Record<string, string>} [headers]
 * @param {AbortSignal} [signal]
 * @returns {Promise<any>}
 */
export const post = async (path, body = undefined, headers = {}, signal = undefined) => (await send("POST", path, body, headers, signal)).json();

/** Return a new idempotency key; `crypto.randomUUID` exists on loopback and HTTPS only. */
export const newKey = () => Array.from(crypto.getRandomValues(new Uint32Array(4)), (part) => part.toString(16).padStart(8, "0")).join("");

/**
 * Return a function that posts, under the same key for the same body: a second press after a lost answer does nothing twice.
 * It may add a query to the path.
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

/**
 * Send a file in a POST, and return the JSON of the answer.
 * @param {string} path
 * @param {Page.Query} query
 * @param {BodyInit} content
 * @param {string} mediaType
 * @returns {Promise<any>}
 */
export const postFile = async (path, query, content, mediaType) =>
  (await request(path + queryString(query), { method: "POST", headers: { "Content-Type": mediaType }, body: content })).json();

/**
 * Send a PATCH, and return the JSON of the answer with its tag.
 * @param {string} path
 * @param {unknown} body
 * @param {Record<string, string>} [headers]
 */
export const patch = async (path, body, headers = {}) => tagged(await send("PATCH", path, body, headers));

/** Send a PUT, and return the JSON of the answer. @param {string} path @param {unknown} body @returns {Promise<any>} */
export const put = async (path, body) => (await send("PUT", path, body, {})).json();

/** Send a DELETE, and return the JSON of the answer. @param {string} path @returns {Promise<any>} */
export const remove = async (path) => (await send("DELETE", path, undefined, {})).json();

/** Return a query as it stands in an address: `?a=1&a=2`, or nothing. @param {Page.Query} query */
export function queryString(query) {
  const pairs = Object.entries(query).flatMap(([key, value]) =>
    [value].flat().filter((item) => item !== null && item !== undefined && item !== "").map((item) => [key, String(item)]));
  return pairs.length ? `?${new URLSearchParams(pairs)}` : "";
}

/** @param {Response} answer @returns {Promise<Page.Tagged<any>>} */
const tagged = async (answer) => ({ value: parse(await answer.text()), tag: answer.headers.get("ETag") });

/**
 * @param {string} method
 * @param {string} path
 * @param {unknown} body
 * @param {Record<string, string>} headers
 * @param {AbortSignal} [signal]
 */
function send(method, path, body, headers, signal = undefined) {
  const json = body === undefined ? {} : { body: stringify(body) };
  return request(path, { method, headers: { "Content-Type": "application/json", ...headers }, ...json, signal });
}

/**
 * Send a request that only reads. While the service is busy with others, wait as long as it says, and ask again.
 * @param {string} path
 * @param {RequestInit} options
 */
async function requestPatiently(path, options) {
  for (let tries = 1; ; tries += 1) {
    try {
      return await request(path, options);
    } catch (error) {
      if (error.status !== 429 || !error.retryAfterS || tries === MOST_TRIES) throw error;
      await rest(1000 * error.retryAfterS, options.signal ?? undefined);
    }
  }
}

/**
 * Send a request, and throw a Problem unless it succeeds. Addresses are relative, so that the service may live below a prefix.
 * @param {string} path
 * @param {RequestInit} options
 */
async function request(path, options) {
  const headers = { ...options.headers, ...(token() ? { Authorization: `Bearer ${token()}` } : {}) };
  let answer;
  try {
    answer = await fetch(path.replace(/^\//, ""), { ...options, headers });
  } catch (error) {
    if (error.name === "AbortError") throw error;
    throw unreachable();
  }
  if (answer.ok) return answer;
  const problem = await answer.json().catch(() => ({ status: answer.status, title: answer.statusText }));
  throw new Problem({ ...problem, retryAfterS: Number(answer.headers.get("Retry-After")) || 0 });
}

/** Return the problem of a service that does not answer. @param {() => void} [retry] */
export const unreachable = (retry = undefined) =>
  new Problem({ detail: "It may be down, or the network is. What it has stored is safe.", retry });

/**
 * Follow the server-sent events after number `query.after`, or from now on, until `signal`.
 *
 * A stream that breaks off is resumed without a gap. While the page is hidden the stream is closed, and `connected` is not told.
 * A Problem is thrown when what the page shows no longer holds: the token is not valid, or the database was replaced.
 * @param {Page.Query} query
 * @param {(event: Page.ServerEvent) => void} handler
 * @param {(isConnected: boolean, reason?: string) => void} connected learns why the service refused the stream
 * @param {AbortSignal} signal
 */
export async function streamEvents(query, handler, connected, signal) {
  let last = query.after ?? null;
  while (!signal.aborted) {
    let reason = "";
    let visible = null;
    try {
      last ??= /** @type {Api.EventPage} */ (await get("/events/page", { limit: 1 }, signal)).latest;
      await untilVisible(signal);
      if (signal.aborted) return;
      visible = abortWhenHidden(signal);
      const headers = { Accept: "text/event-stream", "Last-Event-ID": String(last) };
      const answer = await request(`/events${queryString(query)}`, { headers, signal: visible.signal });
      connected(true);
      for await (const event of eventsOf(/** @type {ReadableStream<Uint8Array<ArrayBuffer>>} */ (answer.body))) {
        last = event.id ?? last;
        if (event.data) handler({ ...event, data: JSON.parse(event.data) });
      }
    } catch (error) {
      if (signal.aborted) return;
      if (visible?.signal.aborted) continue;
      if (OVER.has(error.status)) throw error;
      if (error.status < 500 && error.status > 0) reason = error.message;
    } finally {
      visible?.abort();
    }
    connected(false, reason);
    await rest(RECONNECT_MS, signal);
  }
}

/** Yield the events of a stream, by the grammar of the HTML standard. @param {ReadableStream<Uint8Array<ArrayBuffer>>} stream */
export async function* eventsOf(stream) {
  const reader = stream.pipeThrough(new TextDecoderStream()).getReader();
  let text = "";
  for (;;) {
    const { value, done } = await reader.read();
    if (done) return;
    text += value.replaceAll("\r\n", "\n");
    const blocks = text.split("\n\n");
    text = blocks.pop() ?? "";
    for (const block of blocks) yield eventOf(block);
  }
}

/** @param {string} block */
function eventOf(block) {
  const event = { kind: "message", id: /** @type {string | null} */ (null), data: "" };
  for (const line of block.split("\n")) {
    const [, name, value] = /^(\w+): ?(.*)$/.exec(line) ?? [];
    if (name === "event") event.kind = value;
    if (name === "id") event.id = value;
    if (name === "data") event.data += value;
  }
  return event;
}
