// @ts-check
/** One world on one canvas: by WebGL, or flat where that is missing. */

import { h } from "../dom.js";
import { onTheme } from "../theme.js";
import { colours } from "./colours.js";
import { bodyPoses, feetOnGround, pathUntil, shapePoses } from "./motion.js";
import * as sideView from "./side_view.js";
import * as webgl from "./webgl.js";

/**
 * @typedef {object} Shared what the stages of a replay have in common
 * @property {import("./camera.js").Camera} camera
 * @property {(time: number) => { target: Page.Vector, further: number }} lookAt the camera's target, and how much farther away it is than usual
 * @property {number} observed the body whose path is drawn
 * @property {AbortSignal} signal
 */

/**
 * Return a painter of shapes on a canvas that has none yet, and its context; flat without WebGL.
 *
 * @param {HTMLCanvasElement} canvas
 * @param {Api.Shape[]} shapes
 */
export function painterOf(canvas, shapes) {
  const gl = webgl.context(canvas);
  return { gl, paint: gl ? webgl.painter(canvas, gl, shapes) : sideView.painter(canvas, shapes) };
}

/**
 * Return the canvas of a world, and `draw(time)`, which draws the same time as before if none is given.
 *
 * @param {Api.ReplayWorld} world
 * @param {number[]} timesS
 * @param {string} label
 * @param {Shared} shared
 */
export function stage(world, timesS, label, { camera, lookAt, observed, signal }) {
  const canvas = h("canvas", { class: "stage-canvas", tabindex: "0", role: "img", "aria-label": label });
  /** @type {WebGL2RenderingContext | null} */
  let gl = null;
  /** @type {Page.Painter | null} */
  let paint = null;
  /** @type {Page.Palette} */
  let palette = {};
  let lastTime = 0;

  function begin() {
    const made = painterOf(canvas, world.shapes);
    gl = made.gl;
    palette = colours();
    canvas.dataset.drawn = gl ? "webgl" : "flat";
    return made.paint;
  }

  function draw(time = lastTime) {
    lastTime = time;
    if (!canvas.width || !canvas.isConnected || signal.aborted) return;
    paint ??= begin();
    const { target, further } = lookAt(time);
    const models = shapePoses(world, bodyPoses(world, timesS, time));
    paint(models, feetOnGround(world, time), camera.viewpoint(target, further, world.slope_rad), palette, pathUntil(world, timesS, time, observed));
    canvas.dataset.time = time.toFixed(3);
  }

  const sizes = new ResizeObserver(() => {
    const sharpness = Math.min(devicePixelRatio, 2);
    Object.assign(canvas, { width: Math.round(canvas.clientWidth * sharpness), height: Math.round(canvas.clientHeight * sharpness) });
    draw();
  });
  sizes.observe(canvas);
  signal.addEventListener("abort", () => {
    sizes.disconnect();
    gl?.getExtension("WEBGL_lose_context")?.loseContext();  // a browser has only a few contexts
  });
  onTheme(() => {
    if (!paint) return;
    palette = colours();
    draw();
  }, signal);
  canvas.addEventListener("webglcontextlost", (event) => event.preventDefault());
  canvas.addEventListener("webglcontextrestored", () => {
    paint = null;
    draw();
  });
  camera.listen(canvas, signal);
  return { canvas, draw };
}
