// @ts-check
/** Triangles of the shapes in a replay, in their own sizes. */

const AROUND = 24;
const RINGS = 12;  // even: a capsule is cut at the middle ring

/** @typedef {{ points: number[], indices: number[] }} Mesh a point is a position and a normal, six numbers */

/**
 * Return the triangles of a shape.
 *
 * @param {{ kind: string, size_m: number[] }} shape
 * @returns {Mesh}
 */
export function mesh({ kind, size_m: size }) {
  if (kind === "box") return box(size);
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
