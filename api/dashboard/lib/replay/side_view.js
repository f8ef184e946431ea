// @ts-check
/** A world drawn flat from the side, where there is no WebGL. */

import { colourOf, css } from "./colours.js";
import { transformed } from "./matrix.js";
import { mesh } from "./meshes.js";
import { solidsOf } from "./motion.js";

const HEIGHT_M = 0.6;
const GROUND = 0.8;  // height of the ground in the picture, from the top
const SMALLER = 5.7;  // how much smaller a robot is drawn for each metre of its middle, so that its top is in the picture

/**
 * Return a painter that draws outlines without depth, from the horizontal direction of the camera.
 *
 * @param {HTMLCanvasElement} canvas
 * @param {Api.Shape[]} shapes
 * @returns {Page.Painter}
 */
export function painter(canvas, shapes) {
  const pen = /** @type {CanvasRenderingContext2D} */ (canvas.getContext("2d"));
  const solids = solidsOf(shapes);
  return (models, grounded, camera, palette) => {
    const scale = (canvas.height / HEIGHT_M) * (1.6 / camera.distance) / Math.max(1, SMALLER * camera.target[2] / camera.scale);
    const ground = GROUND * canvas.height;
    const direction = Math.atan2(camera.eye[1] - camera.target[1], camera.eye[0] - camera.target[0]);
    /** @type {(point: Page.Vector) => [x: number, y: number]} */
    const flat = ([x, y, z]) => [
      canvas.width / 2 + scale * (-(x - camera.target[0]) * Math.sin(direction) + (y - camera.target[1]) * Math.cos(direction)),
      ground - scale * z,
    ];
    pen.fillStyle = css(palette.sky);
    pen.fillRect(0, 0, canvas.width, canvas.height);
    pen.save();
    pen.translate(canvas.width / 2, ground);
    pen.rotate(Math.atan2(camera.up[0] * Math.sin(direction), camera.up[2]));
    pen.translate(-canvas.width / 2, -ground);
    pen.fillStyle = css(palette.floor);
    pen.fillRect(-canvas.width, ground, 3 * canvas.width, 2 * canvas.height + canvas.width);
    solids.forEach((shape, index) => {
      pen.strokeStyle = pen.fillStyle = css(colourOf(shape, palette, grounded.has(shape.body)));
      outline(pen, shape, (point) => flat(transformed(models[index], point)), scale);
    });
    pen.restore();
  };
}

/**
 * @param {CanvasRenderingContext2D} pen
 * @param {Api.Shape} shape
 * @param {(point: Page.Vector) => [x: number, y: number]} toCanvas
 * @param {number} scale
 */
function outline(pen, shape, toCanvas, scale) {
  const { kind, size_m: size } = shape;
  pen.beginPath();
  pen.lineCap = "round";
  if (kind === "box") {
    pen.lineWidth = 2;
    for (const [from, to] of edges(size)) {
      pen.moveTo(...toCanvas(from));
      pen.lineTo(...toCanvas(to));
    }
    pen.stroke();
  } else if (kind === "sphere") {
    pen.arc(...toCanvas([0, 0, 0]), scale * size[0], 0, 2 * Math.PI);
    pen.fill();
  } else if (kind === "hull" || kind === "cylinder") {
    const { points, indices } = mesh(shape);
    pen.lineWidth = 1;
    for (let first = 0; first < indices.length; first += 3) {
      const [a, b, c] = indices.slice(first, first + 3).map((index) => toCanvas(points.slice(6 * index, 6 * index + 3)));
      if ((b[0] - a[0]) * (c[1] - a[1]) > (b[1] - a[1]) * (c[0] - a[0])) continue;  // at the far side
      pen.moveTo(...a);
      pen.lineTo(...b);
      pen.lineTo(...c);
      pen.closePath();
    }
    pen.fill();
    pen.stroke();
  } else {
    pen.lineWidth = 2 * scale * size[0];
    pen.moveTo(...toCanvas([0, 0, size[1] / 2]));
    pen.lineTo(...toCanvas([0, 0, -size[1] / 2]));
    pen.stroke();
  }
}

/**
 * Return the twelve edges of a box.
 *
 * @param {number[]} size
 */
function edges(size) {
  const corners = [0, 1, 2, 3, 4, 5, 6, 7].map((bits) => size.map((edge, k) => ((bits >> k) & 1 ? edge : -edge) / 2));
  return corners.flatMap((from, bits) => [1, 2, 4].filter((bit) => !(bits & bit)).map((bit) => [from, corners[bits | bit]]));
}
