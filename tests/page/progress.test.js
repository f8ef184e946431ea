import assert from "node:assert/strict";
import { test } from "node:test";
import { timeLeft } from "../../api/dashboard/lib/progress.js";

test("only what runs has a time left, which is an interval or not known yet", () => {
  const minutes = { low_s: 130, high_s: 230, text: "2 to 4 min" };
  const left = (state, known, otherwise) => timeLeft({ state, progress: { time_left: known } }, otherwise);
  assert.deepEqual([left("RUNNING", minutes), left("RUNNING", null), left("PAUSING", minutes)], ["2 to 4 min", "not known yet", ""]);
  assert.deepEqual([left("RUNNING", minutes, "–"), left("PAUSED", minutes, "–")], ["2 to 4 min", "–"]);
});
