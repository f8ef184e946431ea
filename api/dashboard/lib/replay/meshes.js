// @ts-check
/** Triangles of the shapes in a replay, in their own sizes. */

import { cross, unit } from "./matrix.js";

const AROUND = 24;
const RINGS = 12;  // even: a capsule is cut at the middle ring

/** @typedef {{ points: number[], indices: number[] }} Mesh a point is a position and a normal, six numbers */

/**
 * Return the triangles of a shape.
 *
 * @param {Pick<Api.Shape, "kind" | "size_m"> & Partial<Api.Shape>} shape
 * @returns {Mesh}
 */
export function mesh({ kind, size_m: size, vertices_m: vertices = [], faces = [] }) {
  if (kind === "box") return box(size);
  if (kind === "hull") return hull(vertices, faces);
  if (kind === "cylinder") return cylinder(size[0], size[1]);
  return kind === "sphere" ? capsule(size[0], 0) : capsule(size[0], size[1]);
}

/**
 * @param {number[]} edges
 * @returns {Mesh}
 */
function box(edges) {
  const points = [];
  const indices = [];
  for (let axis = 0; axis < 3; axis += 1) {
    for (const side of [-1, 1]) {
      const first = points.length / 6;
      for (const [u, v] of [[-1, -1], [1, -1], [1, 1], [-1, 1]]) {
        const corner = [0, 0, 0];
        const normal = [0, 0, 0];
        normal[axis] = side;
        corner[axis] = side;
        corner[(axis + 1) % 3] = u * side;
        corner[(axis + 2) % 3] = v;
        points.push(...corner.map((sign, k) => (sign * edges[k]) / 2), ...normal);
      }
      indices.push(first, first + 1, first + 2, first, first + 2, first + 3);
    }
  }
  return { points, indices };
}

/**
 * Return a capsule along z: a ball whose halves are pulled apart by `length`, which is 0 for a ball.
 *
 * @param {number} radius
 * @param {number} length
 * @returns {Mesh}
 */
function capsule(radius, length) {
  const points = [];
  const indices = [];
  const rows = [];
  for (let ring = 0; ring <= RINGS; ring += 1) {
    const halves = ring < RINGS / 2 ? [1] : ring > RINGS / 2 ? [-1] : [1, -1];
    for (const half of halves) rows.push({ polar: (Math.PI * ring) / RINGS, half });
  }
  for (const { polar, half } of rows) {
    for (let step = 0; step <= AROUND; step += 1) {
      const turn = (2 * Math.PI * step) / AROUND;
      const normal = [Math.sin(polar) * Math.cos(turn), Math.sin(polar) * Math.sin(turn), Math.cos(polar)];
      points.push(radius * normal[0], radius * normal[1], radius * normal[2] + (half * length) / 2, ...normal);
    }
  }
  const wide = AROUND + 1;
  for (let row = 0; row + 1 < rows.length; row += 1) {
    for (let step = 0; step < AROUND; step += 1) {
      const corner = row * wide + step;
      indices.push(corner, corner + wide, corner + 1, corner + 1, corner + wide, corner + wide + 1);
    }
  }
  return { points, indices };
}

/**
 * Return a convex hull, flat on each of its faces.
 *
 * @param {number[][]} vertices
 * @param {number[][]} faces corners anticlockwise as seen from outside
 * @returns {Mesh}
 */
function hull(vertices, faces) {
  const points = [];
  const indices = [];
  for (const face of faces) {
    const first = points.length / 6;
    const [a, b, c] = face.map((corner) => vertices[corner]);
    const normal = unit(cross([0, 1, 2].map((k) => b[k] - a[k]), [0, 1, 2].map((k) => c[k] - b[k])));
    for (const corner of face) points.push(...vertices[corner], ...normal);
    for (let corner = 1; corner + 1 < face.length; corner += 1) indices.push(first, first + corner, first + corner + 1);
  }
  return { points, indices };
}

/**
 * Return a cylinder along z: round at its side, flat at its ends.
 *
 * @param {number} radius
 * @param {number} length
 * @returns {Mesh}
 */
function cylinder(radius, length) {
  const points = [];
  const indices = [];
  for (const half of [1, -1]) {
    const first = points.length / 6;
    points.push(0, 0, (half * length) / 2, 0, 0, half);
    for (let step = 0; step <= AROUND; step += 1) {
      const turn = (2 * Math.PI * step) / AROUND;
      const [x, y] = [Math.cos(turn), Math.sin(turn)];
      points.push(radius * x, radius * y, (half * length) / 2, 0, 0, half, radius * x, radius * y, (half * length) / 2, x, y, 0);
      if (step === AROUND) break;
      const [flat, other] = [first + 1 + 2 * step, first + 3 + 2 * step];
      indices.push(first, ...(half > 0 ? [flat, other] : [other, flat]));
      const below = 2 * AROUND + 3;  // points from one end to the other
      if (half > 0) indices.push(flat + 1, flat + 1 + below, other + 1, other + 1, flat + 1 + below, other + 1 + below);
    }
  }
  return { points, indices };
}
