/** A recorded motion between its frames. */

import { pose, times, unit } from "./matrix.js";

/** The frame before a time, and how far it is on the way to the next. */
export function between(timesS, time) {
  const last = timesS.length - 1;
  const at = Math.min(Math.max((time / (timesS[last] || 1)) * last, 0), last);
  const before = Math.min(Math.floor(at), Math.max(last - 1, 0));
  return [before, at - before];
}

/** The matrix of each body at a time. */
export function bodies(world, timesS, time) {
  const [frame, share] = between(timesS, time);
  const next = Math.min(frame + 1, timesS.length - 1);
  const [p, q] = [world.positions_m[frame], world.positions_m[next]];
  const [u, v] = [world.orientations[frame], world.orientations[next]];
  return Array.from({ length: p.length / 3 }, (_, body) => {
    const position = [0, 1, 2].map((k) => p[3 * body + k] * (1 - share) + q[3 * body + k] * share);
    const from = [0, 1, 2, 3].map((k) => u[4 * body + k]);
    const to = [0, 1, 2, 3].map((k) => v[4 * body + k]);
    const same = from.reduce((sum, each, k) => sum + each * to[k], 0) < 0 ? -1 : 1;  // q and -q are one turn
    return pose(position, unit(from.map((each, k) => each * (1 - share) + same * to[k] * share)));
  });
}

/** The matrix of each shape that moves or stands, but for the ground. */
export function placed(world, frames) {
  return world.shapes.filter((each) => each.kind !== "plane").map((shape) => {
    const own = pose(shape.position_m, shape.orientation);
    return shape.body === null ? own : times(frames[shape.body], own);
  });
}

/** Where the base is over the ground, frame by frame up to a time. */
export function trail(world, timesS, time) {
  const [frame] = between(timesS, time);
  return world.positions_m.slice(0, frame + 1).map(([x, y]) => [x, y]);
}

/** The places of the feet that are on the ground at a time; `contacts` has a list of intervals for each. */
export const onGround = (world, time) =>
  new Set(world.contacts.flatMap((spans, foot) => (spans.some(([from, to]) => from <= time && time <= to) ? [foot] : [])));
