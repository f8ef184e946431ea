import "./fakes.js";
import assert from "node:assert/strict";
import { test } from "node:test";
import { sections } from "../../api/dashboard/lib/sections.js";

const real = { performance: globalThis.performance, setTimeout: globalThis.setTimeout };

/** Return how long a section in sight rests after each loading, in ms. Each loading takes a second and ends as one of `ends`. */
async function restsAfter(ends) {
  const rests = [];
  let now = 0;
  let comeIntoSight;
  globalThis.IntersectionObserver = class {
    constructor(seen) { comeIntoSight = seen; }

    observe() {}

    disconnect() {}
  };
  globalThis.performance = { now: () => now };
  globalThis.setTimeout = (resume, ms) => { rests.push(ms); resume(); };
  const element = { hasChildNodes: () => true };
  await new Promise((end) => {
    sections(new AbortController().signal).add(element, [], () => {
      now += 1000;
      const outcome = ends.shift();
      if (!ends.length) real.setTimeout(end);
      return outcome instanceof Error ? Promise.reject(outcome) : Promise.resolve(outcome);
    });
    comeIntoSight([{ target: element, isIntersecting: true }]);
  });
  Object.assign(globalThis, real);
  return rests;
}

test("a section rests four times as long as its loading took, but a second while the service computes it", async () => {
  assert.deepEqual(await restsAfter([undefined]), [4000]);
  assert.deepEqual(await restsAfter(["pending", "pending", undefined]), [1000, 1000, 4000]);
});

test("a section that could not be loaded again is loaded after the long rest", async () => {
  assert.deepEqual(await restsAfter(["failed", undefined]), [4000, 4000]);
  assert.deepEqual(await restsAfter(["pending", new Error("away"), undefined]), [1000, 4000, 4000]);
});
