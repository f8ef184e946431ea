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

test("what the reader chose is loaded at once, and what was being loaded then neither ends nor fails it", async () => {
  let comeIntoSight;
  globalThis.IntersectionObserver = class {
    constructor(seen) { comeIntoSight = seen; }

    observe() {}

    disconnect() {}
  };
  const loads = [];
  const replaced = [];
  const element = { hasChildNodes: () => true, replaceChildren: () => replaced.push("failed") };
  const parts = sections(new AbortController().signal);
  const loadNow = parts.add(element, ["probed"], () => new Promise((resolve, reject) => { loads.push({ resolve, reject }); }));
  const settled = () => new Promise((resume) => { setTimeout(resume, 5); });
  loadNow();
  assert.equal(loads.length, 0);
  comeIntoSight([{ target: element, isIntersecting: true }]);
  parts.reload([{ kind: "probed" }]);
  assert.equal(loads.length, 1);
  loadNow();
  assert.equal(loads.length, 2);
  loads[0].reject(new Error("away"));
  await settled();
  parts.reload([{ kind: "probed" }]);
  await settled();
  assert.deepEqual([loads.length, replaced], [2, []]);
  loads[1].resolve();
  for (let tries = 0; tries < 400 && loads.length < 3; tries += 1) await settled();
  assert.equal(loads.length, 3);
});
