import assert from "node:assert/strict";
import { test } from "node:test";
import { parse, parseNumber, stringify } from "../../api/dashboard/lib/json.js";

const SEED = "18446744073709551615";

test("a number of 64 bits keeps all its digits, there and back", () => {
  assert.equal(stringify(parse(`{"seed":${SEED},"rate":0.5}`)), `{"seed":${SEED},"rate":0.5}`);
  assert.equal(stringify({ seed: -(2n ** 63n) }, 2), '{\n  "seed": -9223372036854775808\n}');
});

test("text that looks like a number stays text", () => {
  assert.equal(stringify({ name: SEED }), `{"name":"${SEED}"}`);
});

test("only finite numbers are numbers", () => {
  assert.deepEqual([parseNumber("2"), parseNumber("-0.5"), parseNumber("1e3"), parseNumber(SEED)], [2, -0.5, 1000, BigInt(SEED)]);
  assert.deepEqual([parseNumber("many"), parseNumber("1e999"), parseNumber("NaN")], [null, null, null]);
});
