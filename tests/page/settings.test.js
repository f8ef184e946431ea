import { FakeNode } from "./fakes.js";
import assert from "node:assert/strict";
import { test } from "node:test";

const { settings } = await import("../../api/dashboard/views/compare/settings.js");

test("settings that differ and warnings are printed as the service writes them", async () => {
  const found = {
    columns: [{ id: "a", name: "one" }, { id: "b", name: "other" }], note: "3 other settings are equal.",
    settings: [{ pointer: "/strategy/name", setting: "strategy", texts: ["simulated_fit", "random"] }],
    warnings: ["different robots (legs; toy_function): their fitness does not mean the same"],
  };
  globalThis.fetch = () => Promise.resolve(new Response(JSON.stringify(found)));
  const cache = { known: (ids) => ids, get: () => null, namesOf: (ids) => new Map(ids.map((id) => [id, id])) };
  const part = settings({ cache, choice: { experiments: ["a", "b"] }, signal: new AbortController().signal });
  part.update();
  await new Promise((resume) => { setTimeout(resume, 5); });
  assert.equal(part.warnings.textContent, "⚠ Different robots (legs; toy_function): their fitness does not mean the same.");
  for (const words of ["strategy", "/strategy/name", "simulated_fit", "random", "3 other settings are equal."]) assert.ok(part.element.textContent.includes(words), words);
  assert.ok(part.element instanceof FakeNode);
});
