import { FakeNode } from "./fakes.js";
import assert from "node:assert/strict";
import { test } from "node:test";
import { isFunction, isPhysical, meanText, unitsOf, worldsText } from "../../api/dashboard/lib/robots.js";

const { lastIteration } = await import("../../api/dashboard/views/replay.js");
const { actions, primary, refusal } = await import("../../api/dashboard/views/study/actions.js");
const { pastEvents } = await import("../../api/dashboard/views/study/events.js");
const { budgetText, gathered, waitingText } = await import("../../api/dashboard/views/study/head.js");
const { measurements } = await import("../../api/dashboard/views/study/measurements.js");

/** A study with experiments in these states, of each of which `failed` repetitions have failed. */
const study = (states, failed = 0) => ({ id: "s", name: "s", tags: [], experiments: states.map((state) => ({ study: "s", state, progress: { failed } })) });
const buttons = (element) => element.querySelectorAll("button").map(({ textContent }) => textContent);

test("an action that a state forbids says what would permit it", () => {
  assert.equal(refusal("pause", study(["RUNNING"])), "");
  assert.equal(refusal("resume", study(["QUEUED"])), "An experiment that is queued cannot be resumed, only one that is pausing or paused.");
  assert.equal(refusal("extend", study(["FAILED"], 1)), "An experiment that is failed cannot be extended, only one that is completed.");
  assert.equal(refusal("retry", study(["FAILED"], 1)), "");
  assert.equal(refusal("retry", study(["COMPLETED"])), "None of its repetitions has failed, so none can be retried.");
  assert.equal(refusal("pause", study(["COMPLETED", "RUNNING"])), "");
  assert.equal(refusal("pause", study(["COMPLETED", "FAILED"])), "None of its experiments can be paused now: only one that is queued, running or waiting can.");
});

test("one experiment among others has a name of its own, and its study has the rest", () => {
  const labels = (id) => buttons(actions({ id, study: { ...study(["COMPLETED"]), state: "COMPLETED", id, archived_at: null } }).element).slice(7);
  assert.deepEqual(labels("s"), ["Edit name, notes and tags", "New from this", "Archive", "Notify…", "Delete…", "More actions…"]);
  assert.deepEqual(labels("e"), ["Edit name", "New from this", "Delete…", "More actions…"]);
});

test("one action is likely wanted, and the others are behind a button", () => {
  const whole = (states, state, failed = 0) => ({ ...study(states, failed), state, archived_at: null });
  assert.equal(primary(whole(["RUNNING", "COMPLETED"], "RUNNING")), "pause");
  assert.equal(primary(whole(["PAUSED"], "PAUSED")), "resume");
  assert.equal(primary(whole(["FAILED"], "FAILED", 1)), "retry");
  assert.equal(primary(whole(["WAITING"], "WAITING")), null);
  assert.equal(primary(whole(["COMPLETED", "FAILED"], "COMPLETED", 1)), null);

  const shownOf = (element) => element.querySelectorAll("a, button").filter(({ hidden }) => !hidden).map((each) => [each.textContent, each.getAttribute("class")]);
  const { element } = actions({ study: whole(["RUNNING"], "RUNNING") });
  assert.deepEqual(shownOf(element), [["Pause", ""], ["Replay a controller", "button quiet"], ["More actions…", "quiet"]]);
  element.querySelectorAll("button").at(-1).click();
  assert.equal(shownOf(element).length, 7 + 5 + 2);
  const ended = actions({ study: whole(["COMPLETED", "FAILED"], "COMPLETED") }).element;
  assert.deepEqual(shownOf(ended)[0], ["Compare its experiments", "button"]);
});

test("a budget is a preset and its size, of which a baseline may have another", () => {
  const experiment = (iterations, repetitions, level) => ({ level, spec: { iterations, repetitions, budget: { preset: "some_budget" } } });
  assert.equal(budgetText({ experiments: [experiment(10, 40, false), experiment(1, 100, true)] }), "Some budget: 10 iterations, 40 or 100 repetitions");
});

test("an extension whose cost is not confirmed changes nothing, and keeps its dialog", async () => {
  const dialogs = [];
  document.body = { append: (dialog) => { dialogs.push(dialog); } };
  FakeNode.prototype.showModal = () => {};
  FakeNode.prototype.close = function close() { this.dispatchEvent(new Event("close")); };
  globalThis.FormData = class { [Symbol.iterator] = () => [["repetitions", "9000"]][Symbol.iterator](); };
  const refused = { title: "", status: 422, errors: [{ pointer: "confirm_cost", message: "this takes about 1,229 core-hours" }] };
  globalThis.fetch = () => Promise.resolve(new Response(JSON.stringify(refused), { status: 422 }));
  const experiment = { study: "s", state: "COMPLETED", progress: { failed: 0 }, level: false, spec: { iterations: 9, repetitions: 1 } };
  let loads = 0, closed = 0;
  const page = { id: "s", study: { ...study([]), experiments: [experiment] }, signal: new AbortController().signal, reload: () => { loads += 1; } };
  const shown = async (count) => {
    while (dialogs.length < count) await new Promise((resume) => { setTimeout(resume); });
    return dialogs.at(-1);
  };

  actions(page).element.querySelectorAll("button").find(({ textContent }) => textContent.startsWith("Extend")).click();
  const extension = await shown(1);
  extension.addEventListener("close", () => { closed += 1; });
  extension.querySelector("form").dispatchEvent(new Event("submit"));
  (await shown(2)).close();
  await new Promise((resume) => { setTimeout(resume); });

  assert.match(extension.textContent, /Nothing was changed/);
  assert.deepEqual([loads, closed], [0, 0]);
});

test("samples from before are the first measurements, and on the first page alone", async () => {
  const request = { id: "r", repetition: 0, iteration: 1, kind: "sample", unit: "m/s", answers: [], branch: null, state: "withdrawn" };
  const pages = [[[], null], [[request], "more"], [[{ ...request, id: "s" }], null]];
  globalThis.fetch = () => {
    const [items, next] = pages.shift();
    return Promise.resolve(new Response(JSON.stringify({ items, next })));
  };
  const samples = [{ values: [0.2, 0.4] }, ...Array(60).fill({ values: [0.5] })];
  let load = null;
  const page = { signal: new AbortController().signal, experiment: { id: "e", state: "RUNNING", spec: { reality: { samples } } }, unit: () => "m/s", sections: { add: (_, __, given) => { load = given; } } };
  const [, place, buttons] = measurements(page);
  const rows = () => place.querySelectorAll("tr").map(({ children }) => children.map(({ textContent }) => textContent));

  await load();
  assert.deepEqual(rows()[1].slice(0, 6), ["all", "–", "sample from before", "0.2, 0.4", "0.3", "✓ measured"]);
  assert.equal(rows().length, 1 + 50);
  assert.match(place.textContent, /The spec has all 61 from before/);
  await load();
  assert.deepEqual([rows().length, rows().at(-1)[2]], [1 + 50 + 1, "sample"]);
  buttons.querySelectorAll("button").at(-1).click();
  while (rows().length > 2) await new Promise((resume) => { setTimeout(resume); });
  assert.deepEqual([rows()[1][2], place.textContent.includes("from before")], ["sample", false]);
});

/** A service with these numbers of an experiment's events, `size` a page. */
const service = (numbers, size) => (query) => {
  const items = numbers.filter((number) => number > query.after).slice(0, size).map((number) => ({ number }));
  return Promise.resolve({ items, last: items.length === size ? items.at(-1).number : Infinity });
};

test("past events come from the newest to the oldest, each once, however they are spread", async () => {
  const numbers = [1, 2, 3, 500, 501, 1200, ...Array.from({ length: 300 }, (_, index) => 2000 + index), 2500];
  const past = pastEvents(service(numbers, 1000), 2300);
  const found = [];
  while (!past.isOver()) found.push(...(await past.next(60)).map(({ number }) => number));
  assert.deepEqual(found, numbers.filter((number) => number <= 2300).reverse());
});

test("texts of several experiments come once, with the experiments unless all have them", () => {
  const study = { experiments: [{ name: "a", warnings: ["all", "some"] }, { name: "b", warnings: ["all"] }] };
  assert.deepEqual(gathered(study, ({ warnings }) => warnings), [{ text: "all", note: "" }, { text: "some", note: "a" }]);
});

test("a replay begins with the last iteration that the first repetition is sure to have", () => {
  const at = (done, level = false) => lastIteration({ level, progress: { iterations_done: done, repetitions: 4 }, spec: { iterations: 10 } });
  assert.deepEqual([at(0), at(4), at(19), at(44), at(44, true)], [0, 0, 3, 10, 0]);
});

test("the catalogue tells units, and functions from robots that move", () => {
  const catalogue = { robots: [{ name: "legs", details: { unit: "m/s", function: false } }, { name: "curve", details: { unit: "1", function: true } }],
    tasks: [{ name: "recorded", details: { unit: "× untuned" } }] };
  const of = (name, task) => ({ spec: { robot: { name }, task: task && { name: task } } });
  assert.deepEqual(["legs", "curve", "gone"].map((name) => isFunction(catalogue, of(name))), [false, true, false]);
  assert.deepEqual([of("legs"), of("legs", "recorded"), of("gone"), undefined].map(unitsOf(catalogue)), ["m/s", "× untuned", "", ""]);
});

test("an experiment says in a sentence what it waits for", () => {
  const request = { bench: "leg", repetition: 0, iteration: 3, kind: "sample", state: "taken", taken_by: "Bo", unanswered: 0, busy: false };
  assert.equal(waitingText([request]), "It waits for a measurement on the bench “leg”: sample of iteration 3, repetition 0 (taken by Bo).");
  assert.match(waitingText([request, request]), /, and for 1 other\.$/);
  assert.match(waitingText([request, request, request], true), /, and for more than 2 others\.$/);
});

test("worlds are the engines, or the bench", () => {
  const spec = (reality) => ({ engine: { name: "fast" }, reality });
  assert.deepEqual([{ engine: { name: "fast" } }, { engine: { name: "slow" } }, { kind: "physical", engine: null, bench: "leg" }, { kind: "recorded", engine: null, pool: { name: "tosses" } }].map((reality) => worldsText(spec(reality))),
    ["Fast", "Fast, reality in Slow", "Fast, reality on the bench “leg”", "Fast, reality is the pool “tosses”"]);
  assert.deepEqual([isPhysical({ spec: { reality: { kind: "simulated" } } }), isPhysical({ spec: { reality: { kind: "physical" } } })], [false, true]);
  assert.deepEqual(["simulated", "recorded"].map((kind) => meanText({ spec: { reality: { kind } } }, -0.25)), ["−0.250", "0.250"]);
});
