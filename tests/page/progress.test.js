import assert from "node:assert/strict";
import { test } from "node:test";
import { fraction, repetitionsDone, timeLeft, timeLeftFact } from "../../api/dashboard/lib/progress.js";

test("rollouts that were not needed are done, and no progress is beyond the end", () => {
  assert.equal(fraction({ rollouts: 100, rollouts_done: 20, rollouts_saved: 30 }), 0.5);
  assert.equal(fraction({ rollouts: 100, rollouts_done: 90, rollouts_saved: 30 }), 1);
  assert.equal(fraction({ rollouts: 0, rollouts_done: 0, rollouts_saved: 0 }), 0);
});

test("failed repetitions are named, where there are any", () => {
  assert.equal(repetitionsDone({ completed: 1, repetitions: 4000, failed: 0 }), "1 of 4,000");
  assert.equal(repetitionsDone({ completed: 1, repetitions: 4, failed: 2 }), "1 of 4, 2 failed");
});

test("only what runs has a time left", () => {
  const at = (state, seconds) => ({ state, progress: { seconds_left: seconds } });
  assert.deepEqual([timeLeft(at("RUNNING", 60)), timeLeft(at("STOPPING", null)), timeLeft(at("PAUSED", 60))], ["60 s", "…", ""]);
  assert.deepEqual([timeLeftFact(at("RUNNING", 60)), timeLeftFact(at("RUNNING", null)), timeLeftFact(at("QUEUED", 60))], ["60 s", "not known yet", "–"]);
});
