import { FakeElement, FakeParent } from "./fakes.js";
import assert from "node:assert/strict";
import { test } from "node:test";
import { keyedRows } from "../../api/dashboard/lib/keyed_rows.js";
import { restOfList } from "../../api/dashboard/views/list/merging.js";

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
