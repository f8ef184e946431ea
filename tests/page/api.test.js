import "./fakes.js";
import assert from "node:assert/strict";
import { test } from "node:test";

const { eventsOf, queryString } = await import("../../api/dashboard/lib/api.js");

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
