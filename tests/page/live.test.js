import { FakeNode } from "./fakes.js";
import assert from "node:assert/strict";
import { test } from "node:test";

Object.assign(globalThis.document, { addEventListener() {}, getElementById: () => new FakeNode("p") });
const { ageOf, follow, keepAges, latestAnswers } = await import("../../api/dashboard/lib/live.js");
const { rest } = await import("../../api/dashboard/lib/waiting.js");
const { keepUp } = await import("../../api/dashboard/views/study.js");
const { actions } = await import("../../api/dashboard/views/study/actions.js");

const real = { setInterval: globalThis.setInterval };

/** Run what `start` begins with `setInterval`, and return a function that lets the time come. */
function ticking(start) {
  let tick;
  globalThis.setInterval = (callback) => { tick = callback; };
  start();
  Object.assign(globalThis, real);
  return () => tick();
}

test("a pause leaves no listener at a signal that lives longer", async () => {
  const leaving = new AbortController();
  let isCalled = false;
  const signal = { addEventListener: (name, _, options) => leaving.signal.addEventListener(name, () => { isCalled = true; }, options) };
  await rest(1, signal);
  leaving.abort();
  assert.equal(isCalled, false);
});

test("a pause ends when the reader leaves", async () => {
  const leaving = new AbortController();
  const ended = rest(60_000, leaving.signal);
  leaving.abort();
  await ended;
});

test("of two answers the one that was asked for later stays, and a saved change is later than both", async () => {
  const waiting = [];
  const shown = [];
  const { reload, take } = latestAnswers(() => new Promise((resolve) => { waiting.push(resolve); }), (tagged) => shown.push(tagged));
  const [first, second, third] = [reload(), reload(), reload()];
  waiting[0]("first");
  await first;
  waiting[2]("third");
  await third;
  waiting[1]("second");
  await second;
  const late = reload();
  take("saved");
  waiting[3]("before it was saved");
  await late;
  assert.deepEqual(shown, ["first", "third", "saved"]);
});

test("a page that nobody sees, or that has ended, is not loaded again and again", () => {
  const done = [];
  const page = { signal: new AbortController().signal, study: { experiments: [{ state: "RUNNING" }] }, update: () => done.push("update"), reload: () => Promise.resolve(done.push("reload")) };
  const tick = ticking(() => keepUp(page));
  tick();
  document.hidden = true;
  tick();
  document.hidden = false;
  page.study.experiments[0].state = "COMPLETED";
  tick();
  assert.deepEqual(done, ["reload", "update"]);
});

test("an age goes on while the page is open", () => {
  const place = new FakeNode("div");
  const time = ageOf(new Date(Date.now() - 5000).toISOString());
  place.append(time);
  assert.equal(place.textContent, "5 s ago");
  const tick = ticking(() => keepAges(place, new AbortController().signal));
  time.dateTime = new Date(Date.now() - 3_600_000).toISOString();
  tick();
  assert.equal(place.textContent, "60 min ago");
});

test("a new study has the seed of the old one to the last digit", async () => {
  globalThis.location = { hash: "" };
  globalThis.fetch = () => Promise.resolve(new Response('{"spec": {"seed": 18446744073709551615}, "remarks": []}'));
  const experiments = [{ study: "s", state: "COMPLETED", progress: { failed: 0 } }];
  actions({ id: "s", study: { id: "s", state: "COMPLETED", experiments } }).element.querySelectorAll("button").find(({ textContent }) => textContent === "New from this").click();
  while (!location.hash) await new Promise((resume) => { setTimeout(resume); });
  assert.equal(new URLSearchParams(location.hash.split("?")[1]).get("spec"), '{"seed":18446744073709551615}');
});

test("after a break everything is asked for anew until it is there, also if something happens meanwhile", async () => {
  const streams = [];
  globalThis.fetch = () => Promise.resolve(new Response(new ReadableStream({ start: (stream) => streams.push(stream) })));
  const told = [];
  const refresh = (events) => {
    told.push(events.map((each) => each.data.number));
    return told.length === 1 ? Promise.reject(new Error("not yet")) : Promise.resolve();
  };
  const until = async (holds) => { while (!holds()) await new Promise((resume) => { setTimeout(resume, 20); }); };
  const send = (number) => streams.at(-1).enqueue(new TextEncoder().encode(`id: ${number}\ndata: {"number": ${number}}\n\n`));
  const leaving = new AbortController();
  follow({ after: 0 }, refresh, leaving.signal);
  await until(() => streams.length === 1);
  streams[0].close();
  await until(() => streams.length === 2);
  send(1);
  await until(() => told.length === 1);
  send(2);
  await until(() => told.length === 2);
  send(3);
  await until(() => told.length === 3);
  leaving.abort();
  assert.deepEqual(told, [[], [], [3]]);
});
