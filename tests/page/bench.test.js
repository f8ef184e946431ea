import { FakeNode, FakeStorage } from "./fakes.js";
import assert from "node:assert/strict";
import { test } from "node:test";
import { keyed, newKey } from "../../api/dashboard/lib/api.js";
import { browserStore, isTemporary, outbox } from "../../api/dashboard/lib/bench/outbox.js";
import { answerText, isMine, nextRequest, requestWords, stateText, typedNumber, typedValues, withOtherSign } from "../../api/dashboard/lib/bench/requests.js";
import { backoffMs } from "../../api/dashboard/lib/waiting.js";

globalThis.localStorage = new FakeStorage();
const { sentList, summaryOf } = await import("../../api/dashboard/views/bench/sent.js");
const { answers: sentAnswers } = await import("../../api/dashboard/lib/bench/sender.js");
const { withChosen } = await import("../../api/dashboard/views/bench.js");
const { correctionOf, undoButtons } = await import("../../api/dashboard/lib/bench/corrections.js");

const ANSWER = { request: "r1", words: "sample of iteration 1", body: { values: [0.5] } };

/** A service that answers as told, and keeps one measurement for each key. */
function service(...outcomes) {
  const stored = new Map();
  const sent = [];
  const send = (entry) => {
    sent.push(entry.key);
    const { status, isLost = false } = outcomes.shift() ?? {};
    if (status) return Promise.reject(Object.assign(new Error(`status ${status}`), { status }));
    if (!stored.has(entry.key)) stored.set(entry.key, { id: `m${stored.size}`, state: "counted" });
    return isLost ? Promise.reject(Object.assign(new Error("no answer"), { status: 0 })) : Promise.resolve(stored.get(entry.key));
  };
  return { stored, sent, send };
}

const box = (send, storage) => outbox(send, () => {}, browserStore("answer", storage, "/"));

test("an answer whose acknowledgement is lost is sent again under its key, also after a reload, and stored once", async () => {
  const storage = new FakeStorage();
  const { stored, sent, send } = service({ isLost: true }, { status: 503 }, {});
  const { key } = box(send, storage).add(ANSWER);
  assert.equal(await box(send, storage).flush(), false);
  assert.equal(await box(send, storage).flush(), false);
  assert.equal(await box(send, storage).flush(), true);
  assert.deepEqual([sent, stored.size], [[key, key, key], 1]);
  assert.equal(await box(send, storage).flush(), true);
  assert.equal(sent.length, 3);
  assert.deepEqual(box(send, storage).list().map(({ state, answer }) => [state, answer.id]), [["sent", "m0"]]);
});

test("two tabs that send at once store one measurement", async () => {
  const storage = new FakeStorage();
  const { stored, send } = service();
  const tabs = [box(send, storage), box(send, storage)];
  tabs[0].add(ANSWER);
  await Promise.all(tabs.map((tab) => tab.flush()));
  assert.equal(stored.size, 1);
  assert.equal(tabs[1].list()[0].state, "sent");
});

test("an answer given while another is sent is sent too, in order", async () => {
  const storage = new FakeStorage();
  const { sent, send } = service();
  const answers = box(send, storage);
  const first = answers.add(ANSWER);
  const flushing = answers.flush();
  const second = answers.add({ ...ANSWER, request: "r2" });
  assert.equal(await flushing, true);
  assert.deepEqual(sent, [first.key, second.key]);
});

test("a refused answer is kept with the reason until a person discards it, and holds up nothing", async () => {
  const storage = new FakeStorage();
  const answers = box(service({ status: 422 }, {}).send, storage);
  const { key } = answers.add(ANSWER);
  answers.add({ ...ANSWER, request: "r2" });
  assert.equal(await answers.flush(), true);
  assert.deepEqual(answers.list().map(({ state, message }) => [state, message]), [["refused", "status 422"], ["sent", undefined]]);
  answers.forget(key);
  assert.equal(answers.list().length, 1);
});

test("what another tab discarded does not come back with its acknowledgement", async () => {
  const storage = new FakeStorage();
  const answers = box((entry) => {
    box(null, storage).forget(entry.key);
    return Promise.resolve({});
  }, storage);
  answers.add(ANSWER);
  await answers.flush();
  assert.deepEqual(answers.list(), []);
});

test("only answers that the service cannot judge yet wait", () => {
  assert.deepEqual([0, 401, 403, 408, 429, 500, 503].map((status) => isTemporary({ status })), Array(7).fill(true));
  assert.deepEqual([400, 404, 409, 413, 422].map((status) => isTemporary({ status })), Array(5).fill(false));
  assert.match(newKey(), /^[0-9a-f]{32}$/);
});

test("a browser that keeps nothing holds answers while the page is open, and says so", () => {
  const storage = new FakeStorage();
  storage.isFull = true;
  const store = browserStore("draft", storage, "/lab/");
  store.write("r1", { note: "wet" });
  assert.deepEqual([store.read("r1"), store.isKept(), store.names()], [{ note: "wet" }, false, ["r1"]]);
  storage.isFull = false;
  store.write("r1", { note: "dry" });
  assert.deepEqual([store.isKept(), browserStore("draft", storage, "/").names()], [true, []]);
  storage.setItem("gaplab-bench /lab/ draft r2", "{half");
  assert.equal(store.read("r2"), null);
});

test("numbers are read as people type them, and all mistakes are told at once", () => {
  assert.deepEqual(["0.41", " 0,41 ", "−2", "+3.", ".5", "1e-3"].map(typedNumber), [0.41, 0.41, -2, 3, 0.5, 0.001]);
  assert.deepEqual(["", "0x10", "1,2,3", "4 m/s", "NaN", "1e999"].map(typedNumber), Array(6).fill(null));
  assert.deepEqual(["0.5", " -0.5", "−3", ""].map(withOtherSign), ["-0.5", "0.5", "3", "-"]);
  const { values, mistakes } = typedValues(["0.4", "x", ""]);
  assert.deepEqual([values, mistakes], [[0.4], [null, "“x” is not a number, such as 0.41", "a number is missing"]]);
});

test("answers and requests are words", () => {
  assert.equal(answerText({ values: [0.41, 0.4] }, "m/s"), "0.41, 0.4 m/s");
  assert.equal(answerText({ values: null, failed: "a leg slipped" }, "m/s"), "failed: a leg slipped");
  assert.equal(answerText({ traces: ["ab", "cd"] }, "m/s"), "2 traces");
  assert.equal(requestWords({ repetition: 0, iteration: 3, kind: "probe" }), "probe of iteration 3, repetition 0");
});

test("a correction has values or a reason, and names every value that is none", () => {
  assert.deepEqual(correctionOf({ value_1: "0,5", value_2: "0.6", failed: " " }, ["0.4", "0.6"]), { values: [0.5, 0.6] });
  assert.deepEqual(correctionOf({ value_1: "", failed: " it fell " }, [""]), { failed: "it fell" });
  assert.deepEqual(correctionOf({ value_1: "0.4", failed: "it fell" }, ["0.4"]), { failed: "it fell" });
  assert.throws(() => correctionOf({ value_1: "0.5", failed: "it fell" }, [""]), { message: "A measurement has values, or a reason why it failed. Clear one of them." });
  assert.throws(() => correctionOf({ value_1: "a", value_2: "", failed: "" }, ["", ""]), { message: "Repeat 1: “a” is not a number, such as 0.41. Repeat 2: a number is missing." });
});

test("the next request is the one held here, else the chosen, else the oldest that is free", () => {
  const at = (id, state, more = {}) => ({ id, state, takes: 1, busy: false, ...more });
  const requests = [at("a", "stuck"), at("b", "open", { busy: true }), at("c", "open"), at("d", "taken")];
  assert.equal(nextRequest(requests, {}).next.id, "c");
  assert.equal(nextRequest(requests, { chosen: "b" }).next.id, "b");
  assert.equal(nextRequest(requests, { chosen: "b", holding: { request: "d", take: 1, operator: "Ada" } }).next.id, "d");
  assert.equal(nextRequest(requests, { answered: new Set(["c"]) }).next.id, "b");
  assert.deepEqual(nextRequest(requests, {}).others.map(({ id }) => id), ["a", "b", "d"]);
  assert.deepEqual(nextRequest([], {}), { next: null, others: [] });
  assert.equal(isMine(at("d", "taken", { takes: 2 }), { request: "d", take: 1, operator: "Ada" }), false);
});

test("tries are farther apart each time, up to half a minute", () => {
  assert.deepEqual([0, 1, 2, 5, 6, 60].map(backoffMs), [0, 1000, 2000, 16_000, 30_000, 30_000]);
});

test("a sentence says what is stored and what waits", () => {
  const of = (...states) => summaryOf(states.map((state) => ({ state })));
  assert.equal(of("sent", "sent"), "✓ All of them are stored by the service.");
  assert.equal(of("waiting", "sent"), "1 answer waits in this browser until the service has it.");
  assert.equal(of("waiting", "waiting", "refused"), "2 answers wait in this browser until the service has them. 1 was refused.");
});

test("requests say who has them, or why nobody may take them", () => {
  const at = (state, more = {}) => stateText({ state, taken_by: null, unanswered: 0, busy: false, ...more });
  assert.deepEqual([at("open"), at("open", { busy: true }), at("taken", { taken_by: "Bo" }), at("stuck", { unanswered: 5 })],
    ["○ open", "○ open, its bench is busy", "▶ taken by Bo", "✕ stuck: taken 5 times without an answer"]);
});

/** Let the service answer every request so, and return the requests. */
function answering(answer) {
  const requests = [];
  globalThis.fetch = (path, { headers = {}, body } = {}) => {
    requests.push({ path, key: headers["Idempotency-Key"], body });
    return Promise.resolve(new Response(JSON.stringify(answer(path)), { status: answer(path).status ?? 200 }));
  };
  return requests;
}

/** Press a button, and return the dialog that opens. */
async function dialogOf(button) {
  let dialog;
  document.body = { append: (element) => { dialog = element; } };
  FakeNode.prototype.showModal = () => {};
  button.click();
  while (!dialog) await new Promise((resume) => { setTimeout(resume); });
  return dialog;
}

test("the dialog that corrects a failure begins empty, and says why it failed", async () => {
  answering(() => ({ words: "nothing follows" }));
  const buttons = undoButtons({ answer: { id: "m1", values: null, failed: "it fell" }, repeats: 2, unit: "m/s", words: "sample" }, new AbortController().signal, () => {});
  const dialog = await dialogOf(buttons.querySelector("button"));
  assert.deepEqual(dialog.querySelectorAll("input").map(({ value }) => value), ["", "", "", ""]);
  assert.match(dialog.textContent, /now: it fell/);
});

test("a failed answer is corrected with as many values as were asked for", async () => {
  answering(() => ({ words: "nothing follows" }));
  const { key } = sentAnswers.add({ request: "r1", words: "sample", repeats: 3, body: { failed: "it fell" } });
  const [entry] = sentAnswers.list();
  browserStore("answer").write(key, { ...entry, state: "sent", answer: { id: "m1", state: "counted", values: null, failed: "it fell" } });
  const list = sentList({ signal: new AbortController().signal, refresh: () => {} });
  list.update();
  const correct = list.element.querySelectorAll("button").find((button) => button.textContent === "Correct…");
  const dialog = await dialogOf(correct);
  assert.deepEqual(dialog.querySelectorAll("input").map(({ attributes }) => attributes.name), ["value_1", "value_2", "value_3", "failed", "reason"]);
});

test("the same body is posted under the same key, also with a seed of 64 bits", async () => {
  const requests = answering(() => ({}));
  const send = keyed("/studies");
  await send({ seed: 18446744073709551615n });
  await send({ seed: 18446744073709551615n });
  await send({ seed: 18446744073709551614n });
  const [first, second, third] = requests.map(({ key }) => key);
  assert.equal(first, second);
  assert.notEqual(second, third);
  assert.equal(requests[0].body, '{"seed":18446744073709551615}');
});

test("a chosen request beyond the first page is loaded, as long as it is wanted", async () => {
  const states = { "requests/last": { id: "last", state: "open" }, "requests/done": { id: "done", state: "measured" }, "requests/gone": { status: 404 } };
  const requests = answering((path) => states[path]);
  const full = Array.from({ length: 100 }, (_, index) => ({ id: `r${index}`, state: "open" }));
  const { signal } = new AbortController();
  const lastOf = async (chosen, page = full) => (await withChosen(page, chosen, signal)).at(-1).id;
  assert.deepEqual(await Promise.all(["last", "done", "gone", "r5", null].map((chosen) => lastOf(chosen))), ["last", "r99", "r99", "r99", "r99"]);
  assert.equal(await lastOf("last", full.slice(0, 3)), "r2");
  assert.equal(requests.length, 3);
});
