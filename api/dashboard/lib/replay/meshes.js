/** Triangles of the shapes that a replay has, in their own sizes: `{ points, indices }`, a point being place and normal. */

const AROUND = 24;
const RINGS = 12;  // even: a capsule is cut at the middle one

/** The triangles of a shape. */
export function mesh({ kind, size_m: size }) {
  if (kind === "box") return box(size);
  return kind === "sphere" ? round(size[0], 0) : round(size[0], size[1]);
}

function box(edges) {
  const points = [];
  const indices = [];
  for (let axis = 0; axis < 3; axis += 1) {
    for (const side of [-1, 1]) {
      const first = points.length / 6;
      for (const [u, v] of [[-1, -1], [1, -1], [1, 1], [-1, 1]]) {
        const at = [0, 0, 0];
        const normal = [0, 0, 0];
        normal[axis] = side;
        at[axis] = side;
        at[(axis + 1) % 3] = u * side;
        at[(axis + 2) % 3] = v;
        points.push(...at.map((each, k) => (each * edges[k]) / 2), ...normal);
      }
      indices.push(first, first + 1, first + 2, first, first + 2, first + 3);
    }
  }
  return { points, indices };
}

/** A ball, or a capsule along z: a ball whose halves were pulled apart. */
function round(radius, length) {
  const points = [];
  const indices = [];
  const rows = [];
  for (let ring = 0; ring <= RINGS; ring += 1) {
    const half = ring < RINGS / 2 ? [1] : ring > RINGS / 2 ? [-1] : [1, -1];
    for (const side of half) rows.push([(Math.PI * ring) / RINGS, side]);
  }
  for (const [polar, side] of rows) {
    for (let step = 0; step <= AROUND; step += 1) {
      const turn = (2 * Math.PI * step) / AROUND;
      const normal = [Math.sin(polar) * Math.cos(turn), Math.sin(polar) * Math.sin(turn), Math.cos(polar)];
      points.push(radius * normal[0], radius * normal[1], radius * normal[2] + (side * length) / 2, ...normal);
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
