/** One world on one canvas: by WebGL, or flat where that is missing. */

import { h } from "../dom.js";
import { onTheme } from "../theme.js";
import { colours } from "./colours.js";
import { bodies, onGround, placed, trail } from "./motion.js";
import * as side from "./side.js";
import * as webgl from "./webgl.js";

/**
 * The stage of a world: its `canvas`, and `draw(time)`, or of the same time as before if it is left out.
 * `looked(time)` gives what the camera looks at, and how much farther away than usual it has to be.
 */
export function stage(world, timesS, label, { camera, looked, signal }) {
  const canvas = h("canvas", { class: "stage-canvas", tabindex: "0", role: "img", "aria-label": label });
  const feet = [...new Set(world.shapes.filter((each) => each.role === "foot").map((each) => each.body))];
  let gl = null;
  let paint = null;
  let palette = null;
  let now = 0;

  function begin() {
    gl = webgl.context(canvas);
    paint = gl ? webgl.painter(canvas, gl, world.shapes) : side.painter(canvas, world.shapes);
    palette = colours(canvas.parentElement);
    canvas.dataset.drawn = gl ? "webgl" : "flat";
  }

  function draw(time = now) {
    now = time;
    if (!canvas.width || !canvas.isConnected || signal.aborted) return;
    if (!paint) begin();
    const down = new Set([...onGround(world, time)].map((foot) => feet[foot]));
    const { target, further } = looked(time);
    paint(placed(world, bodies(world, timesS, time)), down, camera.of(target, further), palette, trail(world, timesS, time));
    canvas.dataset.time = time.toFixed(3);
  }

  const sizes = new ResizeObserver(() => {
    const sharp = Math.min(devicePixelRatio, 2);
    Object.assign(canvas, { width: Math.round(canvas.clientWidth * sharp), height: Math.round(canvas.clientHeight * sharp) });
    draw();
  });
  sizes.observe(canvas);
  signal.addEventListener("abort", () => {
    sizes.disconnect();
    gl?.getExtension("WEBGL_lose_context")?.loseContext();  // a browser has few of them
  });
  onTheme(() => {
    if (!paint) return;
    palette = colours(canvas.parentElement);
    draw();
  }, signal);
  canvas.addEventListener("webglcontextlost", (event) => event.preventDefault());
  canvas.addEventListener("webglcontextrestored", () => { paint = null; draw(); });
  camera.follow(canvas, signal);
  return { canvas, draw };
}
