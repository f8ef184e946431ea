import "./fakes.js";
import assert from "node:assert/strict";
import { test } from "node:test";

const { eventsOf, get, getFile, post, queryString, streamEvents } = await import("../../api/dashboard/lib/api.js");

/** The events of a stream that arrives in these pieces. */
async function received(...pieces) {
  const stream = new ReadableStream({
    start(controller) {
      for (const piece of pieces) controller.enqueue(new TextEncoder().encode(piece));
      controller.close();
    },
  });
  const events = [];
  for await (const event of eventsOf(stream)) events.push(event);
  return events;
}

test("a query repeats lists and leaves out what is empty", () => {
  assert.equal(queryString({ a: [1, "two", null], b: null, c: "", d: undefined, e: false, f: 0 }), "?a=1&a=two&e=false&f=0");
  assert.equal(queryString({ text: "a b&c" }), "?text=a+b%26c");
  assert.equal(queryString({ a: [] }), "");
});

test("events are read wherever the stream is cut", async () => {
  const expected = [{ kind: "tuned", id: "7", data: "{}" }, { kind: "message", id: null, data: "late" }];
  const text = "event: tuned\nid: 7\ndata: {}\n\ndata: late\n\n";
  assert.deepEqual(await received(text), expected);
  for (let cut = 1; cut < text.length; cut += 1) assert.deepEqual(await received(text.slice(0, cut), text.slice(cut)), expected);
});

test("a comment that keeps a stream open is an event without data, and half an event is none", async () => {
  assert.deepEqual(await received(": ping\r\n\r\ndata: half"), [{ kind: "message", id: null, data: "" }]);
});

/** Let the service give these answers one after the other, and return the requests that it gets. */
function answering(...answers) {
  const requests = [];
  globalThis.fetch = (path, options) => {
    requests.push([options.method ?? "GET", path]);
    const [status, body, headers] = answers.shift();
    return Promise.resolve(new Response(JSON.stringify(body), { status, headers }));
  };
  return requests;
}

const BUSY = [429, { status: 429, title: "A limit is reached", detail: "others draw" }, { "Retry-After": "0.01" }];

test("the page asks again when the service was busy with others", async () => {
  const requests = answering(BUSY, BUSY, [200, { pending: 0 }], BUSY, [200, {}]);
  assert.deepEqual(await get("/experiments/a/predictions"), { pending: 0 });
  assert.equal((await getFile("/figures/curves", { format: "pdf" })).size, 2);
  assert.equal(requests.length, 5);
});

test("the page asks again ten times at most, only if the service says when, and only for a GET", async () => {
  assert.equal(answering(...Array(20).fill(BUSY)).length, 0);
  await assert.rejects(get("/x"), { status: 429, message: "others draw" });
  const never = answering([429, { status: 429 }, {}]);
  await assert.rejects(get("/x"), { status: 429 });
  const posted = answering(BUSY);
  await assert.rejects(post("/experiments", {}), { status: 429, retryAfterS: 0.01 });
  assert.deepEqual([never.length, posted.length], [1, 1]);
});

test("a page that is left does not ask again", async () => {
  const leaving = new AbortController();
  const requests = answering([429, { status: 429 }, { "Retry-After": "1000" }], BUSY);
  const { fetch } = globalThis;
  globalThis.fetch = (path, options) => (options.signal.aborted ? Promise.reject(new DOMException("", "AbortError")) : fetch(path, options));
  const asked = get("/x", {}, leaving.signal);
  setTimeout(() => leaving.abort(), 10);
  await assert.rejects(asked, { name: "AbortError" });
  assert.equal(requests.length, 1);
});

for (const status of [401, 403, 409]) {
  test(`a stream that is refused with ${status} is not asked for again`, async () => {
    document.addEventListener = () => {};
    const requests = answering([status, { status, detail: "the database was replaced" }]);
    const following = streamEvents({ after: 7 }, () => {}, () => {}, new AbortController().signal);
    await assert.rejects(following, { status, message: "the database was replaced" });
    assert.equal(requests.length, 1);
  });
}
