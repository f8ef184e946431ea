import { FakeElement, FakeParent } from "./fakes.js";
import assert from "node:assert/strict";
import { test } from "node:test";
import { keyedRows } from "../../api/dashboard/lib/keyed_rows.js";
import { restOfList } from "../../api/dashboard/views/list/merging.js";
import { merged, sourcesOf } from "../../api/dashboard/views/list/sources.js";

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

test("the parts of a long list meet, whatever came, went or moved", () => {
  const items = (ids) => [...ids].map((id) => ({ id }));
  const rest = (firstPart) => restOfList(items(firstPart), items("abcdef")).map(({ id }) => id).join("");
  assert.deepEqual(["abcd", "nabc", "bcde", "aben", "fabc", "cdn", "xyz", ""].map(rest), ["ef", "def", "f", "f", "de", "ef", "", ""]);
});

test("studies and single experiments are one list, as far as both are loaded", () => {
  const source = (path, days, cursor) => ({ path, query: {}, cursor, items: days.map((day) => ({ id: `${path}${day}`, created_at: `2026-01-0${day}T00:00:00Z` })) });
  const ids = (...sources) => merged(sources, "-created_at").items.map(({ id }) => id).join(" ");
  assert.equal(ids(source("s", [7, 3]), source("e", [9, 5, 1])), "e9 s7 e5 s3 e1");
  assert.equal(ids(source("s", [7, 3], "next"), source("e", [9, 5, 1])), "e9 s7 e5 s3");
  assert.equal(ids(source("s", [], null), source("e", [2, 1])), "e2 e1");
  assert.deepEqual(merged([source("s", [7], "next"), source("e", [9], "next")], "-created_at").ending.map(({ path }) => path), ["e"]);
  const byName = [{ path: "s", items: [{ name: "b" }], cursor: null }, { path: "e", items: [{ name: "a" }, { name: "c" }], cursor: null }];
  assert.deepEqual(merged(byName, "name").items.map(({ name }) => name), ["a", "b", "c"]);
});

test("a list of all asks for studies, and for the experiments without one", () => {
  const asked = (show) => sourcesOf({ show, sort: "name", state: "", strategy: "", text: "" }).map(({ path, query }) => [path, query.alone]);
  assert.deepEqual(asked("all"), [["/studies", undefined], ["/experiments", true]]);
  assert.deepEqual([asked("studies"), asked("experiments")], [[["/studies", undefined]], [["/experiments", undefined]]]);
});
