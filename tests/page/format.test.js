import assert from "node:assert/strict";
import { test } from "node:test";
import { age, count, duration, evaluationsText, fixed, number, percent, readableName, threeDigits, timeBetween, titleOf } from "../../api/dashboard/lib/format.js";

test("a number of real-world evaluations says how many samples were there before", () => {
  assert.equal(evaluationsText({ evaluations: 1, known: 0 }), "1 real-world evaluation");
  assert.equal(evaluationsText({ evaluations: 0, known: 1200 }), "0 real-world evaluations (and 1,200 from before)");
});

test("a missing value is a dash, in every format", () => {
  for (const format of [number, fixed, threeDigits, count, duration]) assert.deepEqual([format(null), format(undefined)], ["–", "–"]);
  assert.equal(timeBetween(null, "2026-01-01T00:00:00Z"), "–");
  assert.equal(timeBetween("2026-01-01T00:00:00Z", null), "–");
});

test("numbers have three decimals at most, and exactly three in columns", () => {
  assert.deepEqual([number(0.12345), number(2), fixed(2), fixed(-0.1)], ["0.123", "2", "2.000", "−0.100"]);
  assert.deepEqual([count(0), count(1234567)], ["0", "1,234,567"]);
});

test("three significant digits keep what is small, and all digits before the point", () => {
  const expected = [[0, "0"], [0.5, "0.5"], [0.0012345, "0.00123"], [-0.98765, "−0.988"], [12345.6, "12346"], [-1.234e-7, "−1.23e−7"]];
  for (const [value, text] of expected) assert.equal(threeDigits(value), text);
});

test("durations change their unit where the smaller one becomes hard to read", () => {
  const expected = [
    [0, "0 s"], [0.1, "less than 1 s"], [89, "89 s"], [90, "2 min"], [5399, "90 min"], [5400, "2 h"],
    [172_799, "48 h"], [172_800, "2 days"], [729 * 86_400, "729 days"], [730 * 86_400, "2 years"],
  ];
  for (const [seconds, text] of expected) assert.equal(duration(seconds), text);
  assert.equal(timeBetween("2026-01-01T00:00:00Z", "2026-01-01T00:01:00Z"), "60 s");
});

test("a time in the future, as of another clock, is now", () => {
  assert.equal(age(new Date(Date.now() + 60_000).toISOString()), "0 s ago");
  assert.equal(age(new Date(Date.now() - 7_200_000).toISOString()), "2 h ago");
});

test("100 % is shown once all is done, and not before", () => {
  assert.deepEqual([percent(0), percent(0.999), percent(1)], ["0 %", "99 %", "100 %"]);
});

test("names of plug-ins become readable, and names that people gave stay", () => {
  assert.deepEqual(["simulated_fit", "a2", "My study", "weights_A", ""].map(readableName), ["Simulated fit", "A2", "My study", "weights_A", ""]);
  assert.deepEqual([["simulated_fit", "simulated_fit"], ["run_a1_v2", "simulated_fit"]].map(([name, strategy]) => titleOf({ name, strategy })), ["Simulated fit", "run_a1_v2"]);
});
