import { FakeNode } from "./fakes.js";
import assert from "node:assert/strict";
import { test } from "node:test";

globalThis.ResizeObserver = class {
  constructor(resized) { ResizeObserver.resized = resized; }

  observe() {}

  disconnect() {}
};
globalThis.Plotly = { react: (canvas) => Promise.resolve(canvas.append(new FakeNode("svg"))), purge: (canvas) => canvas.replaceChildren() };
globalThis.getComputedStyle = () => ({ getPropertyValue: () => "#000", color: "#000", fontFamily: "serif" });
document.head = { append: (script) => script.dispatchEvent(new Event("load")) };

const { plot } = await import("../../api/dashboard/lib/plot.js");
const { chooser } = await import("../../api/dashboard/views/compare/chooser.js");
const { figure } = await import("../../api/dashboard/views/compare/curves.js");
const { curves, otherFigures } = await import("../../api/dashboard/views/study/figures.js");
const { misfit } = await import("../../api/dashboard/views/study/misfit.js");
const { significance } = await import("../../api/dashboard/views/compare/significance.js");
const { CURVE_KINDS } = await import("../../api/dashboard/lib/event_kinds.js");

const settled = () => new Promise((resume) => { setTimeout(resume, 5); });

/** Let the service answer so, and return the paths that it is asked for. */
function serving(answer) {
  const paths = [];
  globalThis.fetch = async (path) => {
    paths.push(path);
    const [status, body] = await answer(path);
    return new Response(JSON.stringify(body), { status });
  };
  return paths;
}

test("a figure that failed is not replaced by the former one when the window changes its size", async () => {
  const place = new FakeNode("div");
  const draw = plot(place, "curves", new AbortController().signal);
  serving(() => [200, { figure: { data: [], layout: {} }, alt: "curves", caption: "the former caption", empty: false, table: null }]);
  assert.equal(await draw({ study: "a" }), true);
  assert.match(place.textContent, /the former caption/);
  serving(() => [500, { status: 500, title: "It broke" }]);
  assert.equal(await draw({ study: "b" }), true);
  place.querySelector("div.plot").clientWidth = 500;
  ResizeObserver.resized();
  await settled();
  assert.match(place.textContent, /It broke/);
  assert.doesNotMatch(place.textContent, /the former caption/);
  assert.equal(place.querySelector("svg"), null);
});

const EXPERIMENT = { name: "one", state: "RUNNING", level: false, fitness: { evaluations: 10 } };
const TEST = { found: "n. s.", text: "0.500 (raw 0.500)" };
const ESTIMATE = { text: "1" };
const SUMMARY = { n: 2, mean: ESTIMATE, interquartile_mean: ESTIMATE, sd: 1 };
const PAIR = {
  first: "a", second: "b", cost: null, from_evaluations: 10, to_evaluations: 10, shared_evaluations: 10, where: "after 1 real-world evaluation (and 12 from before)", sizes: "2, 2",
  difference_text: "0", effect_size_text: "0", improvement: ESTIMATE, shared_streams: false, streams: "apart", summary_first: SUMMARY, summary_second: SUMMARY, trusted: TEST, student: TEST, welch: TEST, mann_whitney: TEST, brown_forsythe: TEST,
};

/** Return the section of tests in a view, whose loading the test begins. */
function comparing() {
  const cache = { known: (ids) => ids, get: () => EXPERIMENT, namesOf: (ids) => new Map(ids.map((id) => [id, id])) };
  const choice = { experiments: ["a", "b"], x: "evaluations", model: {}, equal: false, from: null, to: null, test: "trusted", margin: null, margin_of_direct: null };
  const loading = { now: 0 };
  const sections = { add: (_element, _kinds, load) => { loading.load = load; return () => { loading.now += 1; }; } };
  const view = { cache, choice, sections, signal: new AbortController().signal, change: (changes) => { Object.assign(view.choice, changes); part.update(); } };
  const part = significance(view);
  part.update();
  return { part, loading, view };
}

test("one range is asked for, and the others once their table is unfolded", async () => {
  const { part, loading } = comparing();
  const paths = serving(() => [200, [PAIR]]);
  await loading.load();
  assert.deepEqual(paths, ["comparisons?study=a&study=b"]);
  const every = part.element.querySelector("details.every");
  const before = loading.now;
  every.setAttribute("open", "");
  every.dispatchEvent(new Event("toggle"));
  assert.equal(loading.now, before + 1);
  await loading.load();
  assert.equal(paths.length, 6);
  assert.match(part.element.querySelector("details.every").textContent, /At 1Mean of 1–10/);
});

test("pairs are tested at equal cost if that is asked for, and the evaluations of each are said", async () => {
  const { part, loading, view } = comparing();
  const pair = { ...PAIR, cost: 7200, where: "at 2 h", evaluations_first: 3, evaluations_second: null };
  const paths = serving(() => [200, [pair]]);
  view.change({ x: "time", model: { cost_s: 90, rollout_s: 0.5, wear: 3 }, equal: true, from: 1, to: 2 });
  await loading.load();
  assert.deepEqual(paths, ["comparisons?study=a&study=b&x=time&cost_s=90&rollout_s=0.5"]);
  assert.match(part.element.querySelector("details.each").textContent, /A a32.*B b–2/);
  assert.equal(part.element.querySelector(".range").hidden, true);
});

test("a small spread is not written as 0", async () => {
  const { part, loading } = comparing();
  serving(() => [200, [{ ...PAIR, summary_first: { ...SUMMARY, sd: 0.00123 } }]]);
  await loading.load();
  assert.match(part.element.querySelector("details.each").textContent, /0\.00123/);
});

test("what an event did not change stays, and the focus stays where something changed", async () => {
  const { part, loading, view } = comparing();
  serving(() => [200, [PAIR]]);
  await loading.load();
  const matrix = part.element.querySelector("table.matrix");
  await loading.load();
  assert.equal(part.element.querySelector("table.matrix"), matrix);
  part.element.querySelector("details.each").querySelector("summary").focus();
  serving(() => [200, [{ ...PAIR, sizes: "3, 2" }]]);
  await loading.load();
  assert.notEqual(part.element.querySelector("table.matrix"), matrix);
  assert.equal(document.activeElement, part.element.querySelector("details.each").querySelector("summary"));
  const button = (text) => part.element.querySelectorAll("button").find(({ textContent }) => textContent === text);
  const pressed = button("mean of 3–10");
  pressed.focus();
  pressed.click();
  assert.deepEqual(view.choice.from, 3);
  assert.equal(document.activeElement, button("mean of 3–10"));
  assert.notEqual(document.activeElement, pressed);
  document.activeElement = null;
});

test("tests that come late are shown unless the reader has chosen others, and an error leaves what fits the choice", async () => {
  const { part, loading, view } = comparing();
  serving(() => [200, [PAIR]]);
  await loading.load();
  serving(() => [500, { status: 500, title: "It broke" }]);
  assert.equal(await loading.load(), "failed");
  assert.ok(part.element.querySelector("table.matrix"));
  view.change({ from: 1, to: 1 });
  assert.equal(loading.now, 2);
  await loading.load();
  assert.equal(part.element.querySelector("table.matrix"), null);
  assert.match(part.element.textContent, /It broke/);
  serving(() => [200, [PAIR]]);
  await loading.load();
  assert.match(part.element.textContent, /The row against the column, after 1 real-world evaluation \(and 12 from before\)/);
});

/** Return the field of a chooser with its list of three matches, and what was chosen. */
async function choosing() {
  const chosen = [];
  const experiment = (name) => ({ id: name, name, state: "RUNNING", created_at: "2026-01-01T00:00:00Z" });
  const study = (name) => ({ ...experiment(name), experiments: [experiment(name)] });
  const cache = { addStudy() {}, studyName: () => null };
  const view = { cache, signal: new AbortController().signal, choice: { experiments: [] }, change: ({ experiments }) => chosen.push(...experiments) };
  serving(() => [200, { items: ["a", "b", "c"].map(study) }]);
  const element = chooser(view);
  const [field, options] = [element.querySelector("input"), element.querySelector("ul")];
  const press = (key) => field.dispatchEvent(Object.assign(new Event("keydown"), { key }));
  field.focus();
  field.dispatchEvent(new Event("focus"));
  await settled();
  return { field, options, press, chosen };
}

test("Enter chooses nothing while what was typed is looked for", async () => {
  const { field, options, press, chosen } = await choosing();
  assert.equal(options.children.length, 3);
  field.value = "c";
  field.dispatchEvent(new Event("input"));
  press("Enter");
  assert.deepEqual(chosen, []);
});

test("the arrows go round the matches", async () => {
  const { options, press } = await choosing();
  const at = (key) => {
    press(key);
    return options.children.findIndex((option) => option.getAttribute("aria-selected") === "true");
  };
  assert.deepEqual(["ArrowUp", "ArrowDown", "ArrowDown", "ArrowUp", "ArrowUp"].map(at), [2, 0, 1, 0, 2]);
});

test("the figure of a comparison is loaded at once for a choice, and with its section for an event", async () => {
  const [loads, asked] = [[], []];
  const sections = { add: (_, kinds, load) => { asked.push(kinds, load); return () => loads.push("now"); } };
  const choice = { experiments: ["a"], x: "evaluations", model: { cost_s: 60 }, equal: false, band: "", each: false };
  const view = { cache: { known: (ids) => ids }, choice, sections, signal: new AbortController().signal };
  const part = figure(view);
  part.update();
  part.update();
  assert.deepEqual([loads, asked[0]], [["now"], CURVE_KINDS]);
  view.choice = { ...choice, x: "rollouts" };
  part.update();
  const paths = serving(() => [200, { empty: true, caption: "", table: null }]);
  assert.equal(await asked[1](), undefined);
  assert.deepEqual([loads.length, paths], [2, ["figures/curves?study=a&x=rollouts&format=json"]]);
});

test("the misfit is saved below a prefix too", async () => {
  let load;
  const [place] = misfit({ experiment: { id: "e" }, sections: { add: (_element, _kinds, given) => { load = given; } }, signal: new AbortController().signal });
  const distribution = { text: "1", n: 1 };
  serving(() => [200, { points: [{ iteration: 1, error: distribution, held_out_error: distribution, gap: distribution, tunables: [] }], remarks: [], unit: "m/s", error_unit: "m/s", verdicts: [], held_out: 0, note: "" }]);
  await load();
  assert.deepEqual(place.querySelectorAll("a").map((link) => link.getAttribute("href")), ["experiments/e/misfit?format=csv"]);
});

test("every figure of an experiment is a section, and its options load it at once", () => {
  const [added, loads] = [[], []];
  const sections = { add: (_element, kinds) => { added.push(kinds); return () => loads.push("now"); } };
  const page = { id: "e", sections, signal: new AbortController().signal, experiment: { id: "e", level: false } };
  const card = curves(page);
  otherFigures(page);
  assert.equal(added.length, 5);
  assert.deepEqual(added[0], CURVE_KINDS);
  card.querySelector("p.options").dispatchEvent(new Event("change"));
  assert.deepEqual(loads, ["now"]);
});
