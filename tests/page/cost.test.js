import { FakeNode } from "./fakes.js";
import assert from "node:assert/strict";
import { test } from "node:test";
import { Problem } from "../../api/dashboard/lib/api.js";
import { confirmingCost } from "../../api/dashboard/lib/dialog.js";

const REFUSED = new Problem({ status: 422, errors: [{ pointer: "confirm_cost", message: "this takes about 1,229 core-hours" }] });
const { signal } = new AbortController();

/** Send what is refused without a confirmation; return the dialog that asks, the queries that were sent, and the answer. */
function asked() {
  let dialog;
  document.body = { append: (element) => { dialog = element; } };
  FakeNode.prototype.showModal = () => {};
  FakeNode.prototype.close = function close() { this.dispatchEvent(new Event("close")); };
  FakeNode.prototype.remove = () => {};
  globalThis.FormData = class { [Symbol.iterator] = () => [][Symbol.iterator](); };
  const sent = [];
  const answer = confirmingCost((query) => {
    sent.push(query);
    return query ? Promise.resolve({ id: "s1" }) : Promise.reject(REFUSED);
  }, signal);
  const shown = (async () => {
    while (!dialog) await new Promise((resume) => { setTimeout(resume); });
    return dialog;
  })();
  return { sent, answer, shown };
}

test("a high cost is sent again once the reader agrees", async () => {
  const { sent, answer, shown } = asked();
  const dialog = await shown;
  assert.match(dialog.textContent, /1,229 core-hours/);

  dialog.querySelector("form").dispatchEvent(new Event("submit"));

  assert.deepEqual(await answer, { id: "s1" });
  assert.deepEqual(sent, ["", "?confirm_cost=true"]);
});

test("nothing is sent again if the reader goes back", async () => {
  const { sent, answer, shown } = asked();

  (await shown).close();

  assert.equal(await answer, null);
  assert.deepEqual(sent, [""]);
});

test("another refusal is not a question", async () => {
  const other = new Problem({ status: 422, errors: [{ pointer: "/robot", message: "unknown" }] });

  await assert.rejects(confirmingCost(() => Promise.reject(other), signal), other);
});
