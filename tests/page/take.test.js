import { FakeStorage } from "./fakes.js";
import assert from "node:assert/strict";
import { test } from "node:test";

const { Take } = await import("../../api/dashboard/views/bench/take.js");

/** A take in a browser that keeps these values, and the requests that a service gets which answers so. */
function taking(storage, ...answers) {
  const sent = [];
  globalThis.localStorage = storage;
  globalThis.document.addEventListener = () => {};
  globalThis.fetch = (path, { headers, body }) => {
    sent.push([path, headers["Idempotency-Key"], JSON.parse(body)]);
    const [status, found] = answers.shift();
    return status ? Promise.resolve(new Response(JSON.stringify(found), { status })) : Promise.reject(new TypeError("no network"));
  };
  const leaving = new AbortController();
  const take = new Take(leaving.signal, () => {});
  leaving.abort();
  return { take, sent };
}

test("a take whose answer is lost is asked for again under its key, also after a reload", async () => {
  const storage = new FakeStorage();
  const lost = taking(storage, [0]);
  await assert.rejects(lost.take.take("r1", "Ada"));
  assert.equal(lost.take.holding, null);
  const again = taking(storage, [200, { id: "r1", takes: 1 }]);
  await again.take.resume([{ id: "r1", state: "taken", taken_by: "Bo", takes: 1 }]);
  assert.deepEqual(again.sent, []);
  await again.take.resume([{ id: "r1", state: "taken", taken_by: "Ada", takes: 1 }]);
  assert.deepEqual(again.take.holding, { request: "r1", take: 1, operator: "Ada" });
  assert.equal(again.sent[0][1], lost.sent[0][1]);
});

test("a request that somebody else took is not held, and the next try has a new key", async () => {
  const { take, sent } = taking(new FakeStorage(), [409, { status: 409 }], [200, { id: "r1", takes: 2 }]);
  await assert.rejects(take.take("r1", "Ada"), { status: 409 });
  await take.take("r1", "Ada");
  assert.notEqual(sent[0][1], sent[1][1]);
  assert.equal(take.holding.take, 2);
});

test("a take that has ended is forgotten, and one that is only out of sight is not", async () => {
  const { take, sent } = taking(new FakeStorage(), [200, { id: "r1", takes: 1 }], [0], [409, { status: 409 }]);
  await take.take("r1", "Ada");
  await take.resume([]);
  await take.beat();
  assert.equal(take.holding.request, "r1");
  await take.beat();
  assert.equal(take.holding, null);
  assert.deepEqual(sent.at(-1), ["requests/r1/heartbeat", undefined, { take: 1 }]);
});

test("a request that was opened again meanwhile is not held", async () => {
  const { take } = taking(new FakeStorage(), [200, { id: "r1", takes: 1 }]);
  await take.take("r1", "Ada");
  await take.resume([{ id: "r1", state: "open", takes: 1 }]);
  assert.equal(take.holding, null);
});
