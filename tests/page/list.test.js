import { FakeElement, FakeParent } from "./fakes.js";
import assert from "node:assert/strict";
import { test } from "node:test";

const { keyedRows } = await import("../../api/dashboard/lib/dom.js");
const { List, restOfList } = await import("../../api/dashboard/views/list.js");
const { addressOf, filtersOf } = await import("../../api/dashboard/views/list/filters.js");

const FILTERS = { sort: "-created_at", state: "", strategy: "", text: "", q: "" };
const PROGRESS = { rollouts: 0, repetitions: 0, completed: 0 };
const study = (name) => ({ id: name, name, state: "RUNNING", caveat: "", tags: [], experiments: [], progress: PROGRESS, created_at: "2026-01-01T00:00:00Z", best: null });
const pageOf = (names, next = null) => ({ items: [...names].map(study), next });

/** Return a list, and the requests that wait for an answer; `answer` answers the oldest. */
function listing() {
  const waiting = [];
  globalThis.fetch = (path) => new Promise((resolve) => {
    waiting.push({ path, answer: (body, status = 200) => resolve(new Response(JSON.stringify(body), { status })) });
  });
  const settled = () => new Promise((resume) => { setTimeout(resume, 5); });
  const list = new List(new AbortController().signal, () => "", FILTERS);
  const answer = async (...given) => {
    await settled();
    waiting.shift().answer(...given);
    await settled();
  };
  const rows = () => list.table.querySelector("tbody").querySelectorAll("a").map((link) => link.textContent).join("");
  return { list, waiting, settled, answer, rows };
}

/** Begin with the studies a and b, of which there are more. */
async function begun() {
  const made = listing();
  made.list.change({ ...FILTERS });
  await made.answer(pageOf("ab", "next"));
  return made;
}

test("a refresh while other filters load keeps neither the former list nor anything of it", async () => {
  const { list, answer, rows, waiting, settled } = await begun();
  list.change({ ...FILTERS, state: "FAILED" });
  list.refresh();
  await settled();
  await answer(pageOf("f"));
  assert.equal(rows(), "f");
  assert.match(waiting[0].path, /state=FAILED/);
  await answer(pageOf("fg"));
  assert.equal(rows(), "fg");
});

test("what is added to a list and what is loaded again do not undo each other", async () => {
  const names = Array.from({ length: 30 }, (_, index) => `${index}`);
  const served = (path) => {
    const query = new URLSearchParams(path.split("?")[1]);
    const [start, limit] = [Number(query.get("cursor")), Number(query.get("limit"))];
    return pageOf(names.slice(start, start + limit), start + limit < names.length ? String(start + limit) : null);
  };
  for (const order of [["lengthen", "refresh"], ["refresh", "lengthen"]]) {
    const { list, rows, waiting, settled } = listing();
    const answerLatest = async () => {
      const { path, answer } = waiting.pop();
      answer(served(path));
      await settled();
    };
    list.change({ ...FILTERS });
    await settled();
    await answerLatest();
    assert.equal(rows(), names.slice(0, 20).join(""));
    for (const name of order) list[name]();
    await settled();
    while (waiting.length) await answerLatest();
    assert.equal(rows(), names.join(""));
  }
});

test("half a query leaves the former list, which is still loaded again", async () => {
  const { list, answer, rows, waiting, settled } = await begun();
  const mistake = { status: 422, title: "No", errors: [{ pointer: "q", message: "a value is missing" }] };
  list.change({ ...FILTERS, q: "tag =" });
  await answer(mistake, 422);
  assert.deepEqual([rows(), list.mistake.textContent], ["ab", "a value is missing"]);
  list.refresh();
  await settled();
  assert.doesNotMatch(waiting[0].path, /q=/);
  await answer(pageOf("abc"));
  assert.deepEqual([rows(), list.mistake.textContent], ["abc", "a value is missing"]);
  list.change({ ...FILTERS, q: "tag = a" });
  await answer(pageOf("a"));
  assert.deepEqual([rows(), list.mistake.textContent], ["a", ""]);
});

test("a view that begins with half a query does not say that it is loading", async () => {
  const { list, answer } = listing();
  list.change({ ...FILTERS, q: "tag =" });
  await answer({ status: 422, title: "No", errors: [{ pointer: "q", message: "a value is missing" }] }, 422);
  assert.deepEqual([list.note.textContent, list.mistake.textContent], ["", "a value is missing"]);
});

test("an address keeps every order that a saved view can have", () => {
  for (const sort of ["created_at", "-created_at", "name", "-name"]) {
    const address = addressOf({ ...FILTERS, sort });
    assert.equal(filtersOf(new URLSearchParams(address.split("?")[1])).sort, sort);
  }
});

test("a study of one is its experiment, and one of several unfolds", async () => {
  const { list, answer } = listing();
  const experiment = (id) => ({ ...study(id), experiments: undefined, strategy: "some_fit", spec: { robot: { name: "legs" }, engine: { name: "fast" }, reality: { engine: { name: "fast" } } }, fitness: null });
  const of = (...ids) => ({ ...study(ids[0]), experiments: ids.map(experiment).map(({ experiments: _, ...each }) => each) });
  list.change({ ...FILTERS });
  await answer({ items: [of("one"), of("two", "three")], next: null });
  const rows = () => list.table.querySelector("tbody").children.map((row) => [row.querySelector("a").href, row.querySelector("span.sub").textContent]);
  assert.deepEqual(rows(), [["#/studies/one", "Some fit · Legs · Fast"], ["#/studies/two", "2 experiments · Legs · Fast"]]);
  list.table.querySelector("button.toggle").click();
  assert.deepEqual(rows().slice(2), [["#/experiments/two", ""], ["#/experiments/three", ""]]);
});

test("the parts of a long list meet, whatever came, went or moved", () => {
  const items = (ids) => [...ids].map((id) => ({ id }));
  const rest = (firstPart) => restOfList(items(firstPart), items("abcdef")).map(({ id }) => id).join("");
  assert.deepEqual(["abcd", "nabc", "bcde", "aben", "fabc", "cdn", "xyz", ""].map(rest), ["ef", "def", "f", "f", "de", "ef", "", ""]);
});

test("rows stay the same elements while items come, go and move", () => {
  const body = new FakeParent();
  const updates = [];
  const show = keyedRows(body, (item) => item[0], () => ({ element: new FakeElement(), update: (item) => updates.push(item) }));
  show(["a", "b", "c"]);
  const [a, b, c] = body.children;
  show(["c1", "d1", "a1"]);
  assert.deepEqual([body.children[0], body.children[2], body.children.length], [c, a, 3]);
  assert.ok(!body.children.includes(b));
  assert.deepEqual(updates, ["a", "b", "c", "c1", "d1", "a1"]);
  show(["b", "c"]);
  assert.notEqual(body.children[0], b);
});
