// @ts-check
/** 4 × 4 matrices as WebGL takes them, column by column; quaternions are x, y, z, w. */

/**
 * Return the product a · b, which applies b first.
 *
 * @param {Page.Matrix} a
 * @param {Page.Matrix} b
 * @returns {Page.Matrix}
 */
export function product(a, b) {
  const out = new Float32Array(16);
  for (let column = 0; column < 4; column += 1) {
    for (let row = 0; row < 4; row += 1) {
      let sum = 0;
      for (let k = 0; k < 4; k += 1) sum += a[4 * k + row] * b[4 * column + k];
      out[4 * column + row] = sum;
    }
  }
  return out;
}

/**
 * Return the frame of a body: turned by a quaternion, then moved to a point.
 *
 * @param {Page.Vector} position
 * @param {Page.Vector} orientation
 * @returns {Page.Matrix}
 */
export function pose([px, py, pz], [x, y, z, w]) {
  return new Float32Array([
    1 - 2 * (y * y + z * z), 2 * (x * y + z * w), 2 * (x * z - y * w), 0,
    2 * (x * y - z * w), 1 - 2 * (x * x + z * z), 2 * (y * z + x * w), 0,
    2 * (x * z + y * w), 2 * (y * z - x * w), 1 - 2 * (x * x + y * y), 0,
    px, py, pz, 1,
  ]);
}

/**
 * Return the projection of a camera.
 *
 * @param {number} angle vertical angle of view, in radians
 * @param {number} aspect
 * @param {number} near
 * @param {number} far
 * @returns {Page.Matrix}
 */
export function perspective(angle, aspect, near, far) {
  const f = 1 / Math.tan(angle / 2);
  return new Float32Array([f / aspect, 0, 0, 0, 0, f, 0, 0, 0, 0, (far + near) / (near - far), -1, 0, 0, (2 * far * near) / (near - far), 0]);
}

/**
 * Return the world as seen from `eye` towards `target`.
 *
 * @param {Page.Vector} eye
 * @param {Page.Vector} target
 * @param {Page.Vector} [upwards]
 * @returns {Page.Matrix}
 */
export function viewFrom(eye, target, upwards = [0, 0, 1]) {
  const back = unit([0, 1, 2].map((k) => eye[k] - target[k]));
  const right = unit(cross(upwards, back));
  const up = cross(back, right);
  return new Float32Array([
    right[0], up[0], back[0], 0, right[1], up[1], back[1], 0, right[2], up[2], back[2], 0,
    -dot(right, eye), -dot(up, eye), -dot(back, eye), 1,
  ]);
}

/**
 * Return the projection of the world along the light onto the level ground at a height.
 *
 * @param {Page.Vector} light
 * @param {number} height
 * @returns {Page.Matrix}
 */
export function shadowOnto([x, y, z], height) {
  return new Float32Array([1, 0, 0, 0, 0, 1, 0, 0, -x / z, -y / z, 0, 0, 0, 0, height, 1]);
}

/**
 * Return a point transformed by a matrix.
 *
 * @param {Page.Matrix} m
 * @param {Page.Vector} point
 */
export const transformed = (m, [x, y, z]) => [0, 1, 2].map((row) => m[row] * x + m[4 + row] * y + m[8 + row] * z + m[12 + row]);

/**
 * Return a vector scaled to length 1; the zero vector stays.
 *
 * @param {Page.Vector} vector
 */
export function unit(vector) {
  const length = Math.hypot(...vector) || 1;
  return vector.map((component) => component / length);
}

/** @type {(a: Page.Vector, b: Page.Vector) => number} */
const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];

/** @type {(a: Page.Vector, b: Page.Vector) => Page.Vector} */
export const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
