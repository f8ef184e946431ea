/** The service: what is asked of it, what it answers, and what happens there. */

import { read, written } from "./json.js";
import { inSight, whileInSight } from "./sight.js";
import { token } from "./token.js";

/** A problem that the service answered with, or that it did not answer (status 0). */
export class Problem extends Error {
  constructor({ status = 0, title = "The service does not answer", detail = "", errors = [], again = null }) {
    super(detail || title);
    Object.assign(this, { status, title, errors, again });
  }
}

/** The JSON at `path`; `query` may hold lists, and leaves out what is null or empty. */
export const get = async (path, query = {}, signal = undefined) =>
  (await request(path + search(query), { signal })).json();

/** The JSON at `path`, and the tag that a change of it names. */
export const tagged = async (path, signal = undefined) => withTag(await request(path, { signal }));

/** The file at `path`. */
export const blob = async (path, query = {}) => (await request(path + search(query), {})).blob();

/** What the service made of a POST. */
export const post = async (path, body = undefined, headers = {}) => (await send("POST", path, body, headers)).json();

/** What the service made of a PATCH, and its tag. */
export const patch = async (path, body, headers = {}) => withTag(await send("PATCH", path, body, headers));

/** A query as it stands in an address: `?a=1&a=2`, or nothing. */
export function search(query) {
  const pairs = Object.entries(query).flatMap(([key, value]) =>
    [value].flat().filter((each) => each !== null && each !== undefined && each !== "").map((each) => [key, String(each)]));
  return pairs.length ? `?${new URLSearchParams(pairs)}` : "";
}

const withTag = async (answer) => ({ value: read(await answer.text()), tag: answer.headers.get("ETag") });

function send(method, path, body, headers) {
  const json = body === undefined ? {} : { body: written(body) };
  return request(path, { method, headers: { "Content-Type": "application/json", ...headers }, ...json });
}

/** Ask, and raise what is wrong as a Problem. Addresses are relative, so that the service may live below a prefix. */
async function request(path, options) {
  const headers = { ...options.headers, ...(token() ? { Authorization: `Bearer ${token()}` } : {}) };
  let answer;
  try {
    answer = await fetch(path.replace(/^\//, ""), { ...options, headers });
  } catch (error) {
    if (error.name === "AbortError") throw error;
    throw new Problem({ detail: "It may be down, or the network is. What it has stored is safe." });
  }
  if (answer.ok) return answer;
  throw new Problem(await answer.json().catch(() => ({ status: answer.status, title: answer.statusText })));
}

/**
 * Server-sent events after `query.after`, or from now on, for as long as `signal` lasts: `handler({ kind, id, data })` for each of them, and
 * `connected(true | false, why)` as the stream comes and goes, with why the service refused it. It is taken up again where it broke off,
 * without a hole. A page that is out of sight lets go of it without a word, until it is in sight again.
 */
export async function events(query, handler, connected, signal) {
  let last = null;
  while (!signal.aborted) {
    let why = "";
    let seen = null;
    try {
      last ??= query.after ?? (await get("/events/page", { limit: 1 }, signal)).latest;
      await inSight(signal);
      if (signal.aborted) return;
      seen = whileInSight(signal);
      const headers = { Accept: "text/event-stream", "Last-Event-ID": last };
      const answer = await request(`/events${search(query)}`, { headers, signal: seen.signal });
      connected(true);
      for await (const event of parsed(answer.body)) {
        last = event.id ?? last;
        if (event.data) handler({ ...event, data: JSON.parse(event.data) });
      }
    } catch (error) {
      if (signal.aborted) return;
      if (seen?.signal.aborted) continue;
      if (error.status === 401 || error.status === 403) throw error;
      if (error.status < 500 && error.status > 0) why = error.message;
    } finally {
      seen?.abort();
    }
    connected(false, why);
    await new Promise((resume) => setTimeout(resume, 1500));
  }
}

/** The events of a stream, by the grammar of the HTML standard. */
async function* parsed(stream) {
  const reader = stream.pipeThrough(new TextDecoderStream()).getReader();
  let text = "";
  for (;;) {
    const { value, done } = await reader.read();
    if (done) return;
    text += value.replaceAll("\r\n", "\n");
    const blocks = text.split("\n\n");
    text = blocks.pop();
    for (const block of blocks) yield fields(block);
  }
}

function fields(block) {
  const event = { kind: "message", id: null, data: "" };
  for (const line of block.split("\n")) {
    const [, name, value] = /^(\w+): ?(.*)$/.exec(line) ?? [];
    if (name === "event") event.kind = value;
    if (name === "id") event.id = value;
    if (name === "data") event.data += value;
  }
  return event;
}
