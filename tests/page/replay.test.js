import { frames } from "./fakes.js";
import assert from "node:assert/strict";
import { test } from "node:test";
import { camera } from "../../api/dashboard/lib/replay/camera.js";
import { clock } from "../../api/dashboard/lib/replay/clock.js";
import { colourOf, components, css } from "../../api/dashboard/lib/replay/colours.js";
import { cross, perspective, pose, product, shadowOnto, transformed, unit, viewFrom } from "../../api/dashboard/lib/replay/matrix.js";
import { mesh } from "../../api/dashboard/lib/replay/meshes.js";
import { bodyPoses, feetOnGround, frameAt, pathUntil, shapePoses } from "../../api/dashboard/lib/replay/motion.js";

const HALF = Math.SQRT1_2;  // a quarter turn about z is (0, 0, HALF, HALF)

const near = (found, expected) => {
  assert.equal(found.length, expected.length);
  found.forEach((value, index) => assert.ok(Math.abs(value - expected[index]) < 1e-6, `${[...found]} is not ${expected}`));
};

/** A clock that notes what it tells. */
function timed(lengthS, signal = new AbortController().signal) {
  const told = { times: [], playing: [] };
  return { told, time: clock(lengthS, { changed: (now) => told.times.push(now), toggled: (on) => told.playing.push(on), signal }) };
}

test("a pose turns first and moves then", () => {
  near(transformed(pose([1, 2, 3], [0, 0, HALF, HALF]), [1, 0, 0]), [1, 3, 3]);
});

test("a product applies its second factor first", () => {
  const turned = pose([0, 0, 0], [0, 0, HALF, HALF]);
  const moved = pose([1, 0, 0], [0, 0, 0, 1]);
  near(transformed(product(turned, moved), [0, 0, 0]), [0, 1, 0]);
  near(transformed(product(moved, turned), [0, 0, 0]), [1, 0, 0]);
});

test("what the camera looks at is before it, on its axis", () => {
  near(transformed(viewFrom([3, 4, 0], [0, 0, 0]), [0, 0, 0]), [0, 0, -5]);
  near(transformed(viewFrom([3, 4, 0], [0, 0, 0]), [0, 0, 1]), [0, 1, -5]);
});

test("on a slope, the picture is upright in the direction against gravity", () => {
  const { eye, target, up } = camera(() => {}).viewpoint([0, 0, 0], 0, 0.3);
  near(up, [Math.sin(0.3), 0, Math.cos(0.3)]);
  const [x, y] = transformed(viewFrom(eye, target, up), up);
  assert.ok(Math.abs(x) < 1e-6 && y > 0);
});

test("a camera is farther away from a large robot, by its size", () => {
  const [small, large] = [1, 4].map((scale) => camera(() => {}, scale).viewpoint([0, 0, 0]));
  near([large.distance / small.distance, large.eye[2] / small.eye[2], large.scale], [4, 4, 4]);
});

test("a lens maps its nearest and farthest planes to −1 and 1", () => {
  const lens = perspective(1, 2, 0.5, 10);
  for (const [z, depth] of [[-0.5, -1], [-10, 1]]) near([(lens[10] * z + lens[14]) / -z], [depth]);
});

test("a shadow lies on the ground, away from the light", () => {
  near(transformed(shadowOnto([1, 0, 1], 0), [0, 0, 2]), [-2, 0, 0]);
  near(unit([0, 3, 4]), [0, 0.6, 0.8]);
  near(unit([0, 0, 0]), [0, 0, 0]);
});

test("a time between frames is a share of the way, and no time is outside of the motion", () => {
  assert.deepEqual(frameAt([0, 1, 2], 1.5), [1, 0.5]);
  assert.deepEqual([frameAt([0, 1, 2], -1), frameAt([0, 1, 2], 9), frameAt([0], 0)], [[0, 0], [1, 1], [0, 0]]);
});

const WORLD = {
  positions_m: [[0, 0, 0], [2, 0, 0], [2, 2, 0]],
  orientations: [[0, 0, 0, 1], [0, 0, -HALF, -HALF], [0, 0, HALF, HALF]],
  contacts: [[[0, 0.5], [1, 2]], []],
  shapes: [
    { kind: "plane", body: null }, { kind: "box", body: 0, role: "foot", position_m: [1, 0, 0], orientation: [0, 0, 0, 1] },
    { kind: "sphere", body: null, position_m: [5, 5, 5], orientation: [0, 0, 0, 1] }],
};

test("a body between two frames is between their places, and turned the short way", () => {
  const [body] = bodyPoses(WORLD, [0, 1, 2], 0.5);
  near(transformed(body, [0, 0, 0]), [1, 0, 0]);
  near(transformed(body, [1, 0, 0]), [1 + HALF, HALF, 0]);
});

test("shapes move with their bodies, stand without one, and the ground is not a solid shape", () => {
  const [box, ball] = shapePoses(WORLD, bodyPoses(WORLD, [0, 1, 2], 1));
  near(transformed(box, [0, 0, 0]), [2, 1, 0]);
  near(transformed(ball, [0, 0, 0]), [5, 5, 5]);
});

test("the path ends at the time, and the feet on the ground are those with contact then", () => {
  assert.deepEqual(pathUntil(WORLD, [0, 1, 2], 1.2), [[0, 0], [2, 0]]);
  assert.deepEqual([0.2, 0.7, 2].map((time) => [...feetOnGround(WORLD, time)]), [[0], [], [0]]);
});

const HULL = { vertices_m: [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 2]], faces: [[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]] };

/** The volume that triangles enclose, if all are anticlockwise as seen from outside. */
function volume({ points, indices }) {
  let sixfold = 0;
  for (let first = 0; first < indices.length; first += 3) {
    const [a, b, c] = indices.slice(first, first + 3).map((index) => points.slice(6 * index, 6 * index + 3));
    const normal = cross(b, c);
    sixfold += a.reduce((sum, value, k) => sum + value * normal[k], 0);
  }
  return sixfold / 6;
}

test("the path is that of the observed body, or of the base where there is no other", () => {
  const world = { positions_m: [[0, 0, 0, 5, 6, 7], [1, 0, 0, 8, 9, 7]] };
  assert.deepEqual(pathUntil(world, [0, 1], 1, 1), [[5, 6]]);
  assert.deepEqual(pathUntil(world, [0, 1], 1, 2), [[0, 0]]);
});

test("triangles of cylinders and hulls enclose their volume, and normals point outwards", () => {
  const cylinder = mesh({ kind: "cylinder", size_m: [1, 2] });
  const hull = mesh({ kind: "hull", size_m: [], ...HULL });
  assert.ok(Math.abs(volume(cylinder) / (2 * Math.PI) - 1) < 0.02);
  near([volume(hull)], [1 / 3]);
  for (let first = 0; first < hull.points.length; first += 6) {
    const [place, normal] = [hull.points.slice(first, first + 3), hull.points.slice(first + 3, first + 6)];
    const outwards = [0, 1, 2].reduce((sum, k) => sum + (place[k] - [0.2, 0.2, 0.4][k]) * normal[k], 0);
    assert.ok(outwards > 0);
  }
});

test("a face of more than three corners is cut into triangles", () => {
  const { indices } = mesh({ kind: "hull", size_m: [], vertices_m: [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], faces: [[0, 1, 2, 3]] });
  assert.deepEqual(indices, [0, 1, 2, 0, 2, 3]);
});

test("triangles of every shape have its size, and normals of length 1", () => {
  const sizes = [["box", [2, 4, 6], [1, 2, 3]], ["sphere", [2], [2, 2, 2]], ["capsule", [1, 4], [1, 1, 3]],
    ["cylinder", [2, 6], [2, 2, 3]], ["hull", [], [1, 1, 2]]];
  for (const [kind, size, extents] of sizes) {
    const { points, indices } = mesh({ kind, size_m: size, ...HULL });
    const corners = Array.from({ length: points.length / 6 }, (_, index) => points.slice(6 * index, 6 * index + 6));
    near([0, 1, 2].map((axis) => Math.max(...corners.map((corner) => corner[axis]))), extents);
    for (const corner of corners) near([Math.hypot(...corner.slice(3))], [1]);
    assert.equal(indices.length % 3, 0);
    assert.ok(Math.max(...indices) < corners.length);
  }
});

test("a clock plays at its speed, starts over at the end, and stops", () => {
  const { told, time } = timed(2);
  time.setSpeed(2);
  time.play();
  frames.run(1000);
  frames.run(1500);
  assert.equal(time.time, 1);
  frames.run(2250);
  assert.equal(time.time, 0.5);
  time.play(false);
  frames.run(9000);
  assert.equal(time.time, 0.5);
  assert.deepEqual(told.playing, [true, false]);
});

test("a clock goes to no time before its beginning or after its end, from where it plays again from the start", () => {
  const { told, time } = timed(2);
  time.goTo(-1);
  time.goTo(7);
  assert.deepEqual(told.times, [0, 2]);
  time.play();
  assert.equal(time.time, 0);
  time.play(false);
});

test("a clock that plays once stops at the end, or when it is told, and says so", () => {
  const { told, time } = timed(2);
  let stops = 0;
  time.goTo(1);
  for (const end of [9000, 500]) {
    time.playOnce(() => { stops += 1; });
    assert.equal(time.time, 0);
    frames.run(0);
    frames.run(end);
    if (end === 500) time.play(false);
    assert.equal(time.time, Math.min(end / 1000, 2));
  }
  assert.equal(stops, 2);
  assert.deepEqual(told.playing, [true, false, true, false]);
});

test("a clock of a view that was left stops", () => {
  const leaving = new AbortController();
  const { told, time } = timed(2, leaving.signal);
  time.play();
  leaving.abort();
  frames.run(1000);
  assert.deepEqual([told.times, frames.waiting.length], [[], 0]);
});

test("a camera stays above the ground, below the zenith, and within reach", () => {
  let moves = 0;
  const { move, viewpoint } = camera(() => { moves += 1; });
  move(0, -9, 0.001);
  const low = viewpoint([1, 2, 0]);
  near([low.distance, low.eye[2]], [0.4, 0.4 * Math.sin(0.05)]);
  move(0, 9, 1e6);
  const high = viewpoint([0, 0, 0], 2);
  near([high.distance, high.eye[2]], [10, 10 * Math.sin(1.5)]);
  assert.equal(moves, 2);
});

test("feet have another colour while they are on the ground", () => {
  const palette = { "foot-up": [1, 0, 0, 1], "foot-down": [0, 0, 1, 1], limb: [0, 1, 0, 1] };
  assert.equal(colourOf({ role: "foot" }, palette, true), palette["foot-down"]);
  assert.equal(colourOf({ role: "foot" }, palette, false), palette["foot-up"]);
  assert.equal(colourOf({ role: "limb" }, palette, true), palette.limb);
});

test("a colour of CSS is read and written", () => {
  assert.deepEqual(components("rgba(255, 0, 51, 0.5)"), [1, 0, 0.2, 0.5]);
  assert.equal(css(components("rgb(255, 0, 51)")), "rgb(255 0 51 / 1)");
});
