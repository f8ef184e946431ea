import "./fakes.js";
import assert from "node:assert/strict";
import { test } from "node:test";

const { trouble } = await import("../../api/dashboard/lib/health.js");
const { Problem } = await import("../../api/dashboard/lib/api.js");

test("a service whose experiments do not run says why", async () => {
  assert.equal(await trouble(() => Promise.resolve({ warnings: ["Ray died", "it starts again"] })), "Ray died; it starts again");
  const hanging = new Problem({ status: 503, detail: "the supervisor has not answered for 40 s" });
  assert.equal(await trouble(() => Promise.reject(hanging)), "the supervisor has not answered for 40 s");
});

test("a healthy service says nothing, and a silent one is left to the view", async () => {
  assert.equal(await trouble(() => Promise.resolve({ status: "ok" })), "");
  assert.equal(await trouble(() => Promise.reject(new Problem({}))), "");
});
