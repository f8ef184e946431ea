import "./fakes.js";
import assert from "node:assert/strict";
import { test } from "node:test";

const { components, lighter, stacked, themed } = await import("../../api/dashboard/lib/figure_theme.js");

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

/** Return a figure with a bar of colours as it is drawn, in the dark or not. */
function shaded(isDark) {
  document.documentElement.dataset.theme = isDark ? "dark" : "light";
  globalThis.getComputedStyle = () => ({ getPropertyValue: () => "#ffffff" });
  const lines = ["#FDAE32", "#6A00A8"].map((color) => ({ mode: "lines", line: { color }, opacity: 0.75 }));
  const others = [{ line: { color: "#0072B2" } }, { line: { color: "#000000" }, meta: { ink: true } }, { marker: { color: [0, 3] } }];
  const coloraxis = { colorscale: [[0, "#FDAE32"], [1, "#6A00A8"]] };
  const { data, layout } = themed({ data: [...lines, ...others], layout: { coloraxis } }, { clientWidth: 900 });
  document.documentElement.dataset.theme = "light";
  return { data, scale: layout.coloraxis.colorscale };
}

test("on a dark ground lines have the colours of the bar beside them, and are as opaque", () => {
  const { data: [first, last, other, ink, points], scale } = shaded(true);
  assert.deepEqual([first.line.color, last.line.color], scale.map(([, color]) => color));
  assert.deepEqual([last.line.color, last.opacity], ["rgba(158,89,198,1)", 1]);
  assert.deepEqual([other.line.color, ink.line.color, points.marker.color], ["rgba(86,172,230,1)", "rgba(255,255,255,1)", [0, 3]]);
});

test("on a light ground lines keep the colours of their shades", () => {
  const { data: [, last], scale } = shaded(false);
  assert.deepEqual([last.line.color, last.opacity, scale[1][1]], ["#6A00A8", 0.75, "#6A00A8"]);
});

test("words below an axis stand upright on a phone where they would overlap, with room for them", () => {
  const { xaxis, height } = stacked({ xaxis: { ticktext: ["a", "b"] }, yaxis: {}, height: 420 });
  assert.deepEqual([xaxis.autotickangles, height], [[0, 90], 520]);
  assert.equal(stacked({ xaxis: {}, height: 420 }).height, 420);
});
