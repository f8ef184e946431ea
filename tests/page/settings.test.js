import assert from "node:assert/strict";
import { test } from "node:test";
import { cellText } from "../../api/dashboard/views/compare/settings.js";

test("a setting is written in words, and a missing one is a dash", () => {
  assert.equal(cellText(["simulated_fit", "random"]), "simulated fit, random");
  assert.equal(cellText([["static_friction", "restitution"]]), "static friction + restitution");
  assert.deepEqual([[true], [false], [null], [0.25], []].map(cellText), ["yes", "no", "none", "0.25", "–"]);
});
