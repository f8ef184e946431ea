// @ts-check
/** A recorded motion at any time, also between its frames. */

import { pose, product, unit } from "./matrix.js";

/**
 * Return the frame before a time, and the share of the way to the next frame.
 *
 * @param {number[]} timesS
 * @param {number} time
 * @returns {[frame: number, share: number]}
 */
export function frameAt(timesS, time) {
  const last = timesS.length - 1;
  const place = Math.min(Math.max((time / (timesS[last] || 1)) * last, 0), last);
  const frame = Math.min(Math.floor(place), Math.max(last - 1, 0));
  return [frame, place - frame];
}

/**
 * Return the matrix of each body at a time.
 *
 * @param {Page.Shown} world
 * @param {number[]} timesS
 * @param {number} time
 */
export function bodyPoses(world, timesS, time) {
  const [frame, share] = frameAt(timesS, time);
  const next = Math.min(frame + 1, timesS.length - 1);
  const [p, q] = [world.positions_m[frame], world.positions_m[next]];
  const [u, v] = [world.orientations[frame], world.orientations[next]];
  return Array.from({ length: p.length / 3 }, (_, body) => {
    const position = [0, 1, 2].map((k) => p[3 * body + k] * (1 - share) + q[3 * body + k] * share);
    const from = [0, 1, 2, 3].map((k) => u[4 * body + k]);
    const to = [0, 1, 2, 3].map((k) => v[4 * body + k]);
    const sign = from.reduce((sum, value, k) => sum + value * to[k], 0) < 0 ? -1 : 1;  // q and -q are the same turn
    return pose(position, unit(from.map((value, k) => value * (1 - share) + sign * to[k] * share)));
  });
}

/**
 * Return the shapes without the ground.
 *
 * @param {Api.Shape[]} shapes
 */
export const solidsOf = (shapes) => shapes.filter(({ kind }) => kind !== "plane");

/**
 * Return the matrix of each solid shape; one without a body stands still.
 *
 * @param {Page.Shown} world
 * @param {Page.Matrix[]} poses of the bodies
 */
export function shapePoses(world, poses) {
  return solidsOf(world.shapes).map(({ body, position_m: position, orientation }) => {
    const inBody = pose(position, orientation);
    return body === null ? inBody : product(poses[body], inBody);
  });
}

/**
 * Return where a body was over the ground, frame by frame up to a time.
 *
 * @param {Api.ReplayWorld} world
 * @param {number[]} timesS
 * @param {number} time
 * @param {number} [body] the base in a world that has only the base
 */
export function pathUntil(world, timesS, time, body = 0) {
  const [frame] = frameAt(timesS, time);
  return world.positions_m.slice(0, frame + 1).map((row) => {
    const first = 3 * body < row.length ? 3 * body : 0;
    return [row[first], row[first + 1]];
  });
}

/**
 * Return the bodies of the feet that are on the ground at a time.
 *
 * @param {Page.Shown} world
 * @param {number} time
 */
export function feetOnGround({ shapes, contacts }, time) {
  const feet = [...new Set(shapes.filter(({ role }) => role === "foot").map(({ body }) => body))];
  return new Set(feet.filter((_, foot) => contacts[foot]?.some(([from, to]) => from <= time && time <= to)));
}
