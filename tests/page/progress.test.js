import assert from "node:assert/strict";
import { test } from "node:test";
import { durationRange } from "../../api/dashboard/lib/format.js";
import { fraction, rolloutsDone, timeLeft, timeLeftFact, workFacts } from "../../api/dashboard/lib/progress.js";

test("rollouts that were saved are done, and no progress is beyond the end", () => {
  assert.equal(fraction({ rollouts: 100, rollouts_done: 20, rollouts_saved: 30 }), 0.5);
  assert.equal(fraction({ rollouts: 100, rollouts_done: 90, rollouts_saved: 30 }), 1);
  assert.equal(fraction({ rollouts: 0, rollouts_done: 0, rollouts_saved: 0 }), 0);
});

const WORK = {
  repetitions: 4000, completed: 1, failed: 0, iterations: 20, iterations_done: 20, counted_iterations: 15, counted_iterations_done: 15,
  rollouts: 1000, rollouts_done: 900, rollouts_failed: 0, rollouts_saved: 0, steps: [],
};

test("failures are named, where there are any, and iterations counted as in a spec", () => {
  assert.deepEqual(workFacts(WORK), [["Repetitions", "1 of 4,000"], ["Iterations", "15 of 15"], ["Rollouts", "900 of 1,000"]]);
  assert.deepEqual(workFacts({ ...WORK, failed: 2, counted_iterations: 0, rollouts_failed: 3 }),
    [["Repetitions", "1 of 4,000, 2 failed"], ["Rollouts", "900 of 1,000, physics failed in 3"]]);
});

test("each step under way tells how far it has come", () => {
  const steps = [["tuning", 3, 419], ["transfer", 2, 1000]].map(([kind, iteration, rollouts], repetition) => ({ repetition, kind, iteration, rollouts, budget: 1000 }));
  assert.deepEqual(workFacts({ ...WORK, steps }).at(-1), ["Now", "tuning 3: 41 %, transfer 2: 100 %"]);
});

test("only what runs has a time left, which is an interval or not known yet", () => {
  const at = (state, left) => ({ state, progress: { time_left: left, seconds_left: 1 } });
  const minutes = { low_s: 130, high_s: 230 };
  assert.deepEqual([timeLeft(at("RUNNING", minutes)), timeLeft(at("RUNNING", null)), timeLeft(at("PAUSING", minutes)), timeLeft(at("PAUSED", minutes))], ["2 to 4 min", "not known yet", "", ""]);
  assert.deepEqual([timeLeftFact(at("RUNNING", minutes)), timeLeftFact(at("RUNNING", null)), timeLeftFact(at("PAUSING", minutes))], ["2 to 4 min", "not known yet", "–"]);
  assert.deepEqual([durationRange({ low_s: 5, high_s: 40 }), durationRange({ low_s: 28_800, high_s: 45_000 })], ["less than 1 min", "8 to 13 h"]);
});

test("saved rollouts are named where there are any", () => {
  assert.equal(rolloutsDone({ rollouts: 1000, rollouts_done: 900, rollouts_saved: 0 }), "900 of 1,000");
  assert.equal(rolloutsDone({ rollouts: 1000, rollouts_done: 900, rollouts_saved: 100 }), "900 of 1,000, 100 saved");
});
