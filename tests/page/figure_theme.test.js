import "./fakes.js";
import assert from "node:assert/strict";
import { test } from "node:test";

const { components, lighter, stacked } = await import("../../api/dashboard/lib/figure_theme.js");

test("colours are read in every notation that the service uses", () => {
  assert.deepEqual(components("#0072B2"), [0, 114, 178, 1]);
  assert.deepEqual(components("rgba(0, 114, 178, 0.1)"), [0, 114, 178, 0.1]);
});

test("dark lines are lighter on a dark ground, with bands that can still be seen; other colours stay", () => {
  assert.equal(lighter("#0072B2"), "rgba(86,172,230,1)");
  assert.equal(lighter("rgba(0, 114, 178, 0.1)"), "rgba(86,172,230,0.13999999999999999)");
  assert.equal(lighter("#123456"), "#123456");
});

test("panels side by side stand one above the other on a phone, without a gap at the top or an overlap", () => {
  const layout = { xaxis: { domain: [0, 0.4] }, xaxis2: { domain: [0.6, 1] }, yaxis: {}, yaxis2: {} };
  const { xaxis2, yaxis, yaxis2, height } = stacked(layout);
  assert.deepEqual(xaxis2.domain, [0, 1]);
  assert.equal(yaxis.domain[1], 1);
  assert.ok(yaxis2.domain[1] < yaxis.domain[0]);
  assert.equal(height, 660);
});

test("one panel stays as it is, and a bar of colours moves above it", () => {
  const layout = { xaxis: { domain: [0, 1] }, margin: { l: 5 }, coloraxis: { colorbar: { title: { text: "Error" } } } };
  const { height, margin, coloraxis } = stacked(layout);
  assert.equal(height, undefined);
  assert.deepEqual(margin, { l: 5, t: 64 });
  assert.deepEqual([coloraxis.colorbar.orientation, coloraxis.colorbar.title], ["h", { text: "Error", side: "top" }]);
});
