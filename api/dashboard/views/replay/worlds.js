// @ts-check
/** The two worlds of a replay side by side, seen by one camera. */

import { h } from "../../lib/dom.js";
import { number } from "../../lib/format.js";
import { empty } from "../../lib/placeholders.js";
import { camera } from "../../lib/replay/camera.js";
import { frameAt } from "../../lib/replay/motion.js";
import { stage } from "../../lib/replay/stage.js";

const SMOOTHING = 12;  // frames to each side over which the camera's path is averaged

/**
 * Return both stages in one element, `draw(time)` for both, and their canvases.
 *
 * @param {Api.Replay} replay
 * @param {boolean} isPhysical whether reality is a robot on a bench
 * @param {AbortSignal} signal
 */
export function worlds(replay, isPhysical, signal) {
  const moving = [replay.simulation, replay.reality].filter((world) => world !== null && world.positions_m.length > 0);
  const paths = moving.map((world) => smoothed(/** @type {Api.ReplayWorld} */ (world).positions_m));
  /** @type {ReturnType<typeof stage>[]} */
  const stages = [];
  const draw = (/** @type {number | undefined} */ time = undefined) => stages.forEach((each) => each.draw(time));
  const { framing, observed } = replay;
  const lookAt = (/** @type {number} */ time) => between(paths, replay.times_s, time, framing.height_m);
  const shared = { camera: camera(() => draw(), framing.scale), lookAt, observed, signal };
  /** @type {(world: Api.ReplayWorld | null, title: string, absent: string) => HTMLElement} */
  const worldPanel = (world, title, absent) => {
    if (!world) return panel(title, "", empty(absent));
    const summary = `${world.fitness === null ? "no fitness" : `${number(world.fitness)} ${replay.unit}`}, ${world.engine}`;
    if (!world.positions_m.length) return panel(title, summary, empty("The physics failed, so there is nothing to see."));
    const made = stage(world, replay.times_s, `${title}: ${summary}`, shared);
    stages.push(made);
    return panel(title, summary, made.canvas);
  };
  const simulated = replay.simulator === null ? "In its simulator" : `In the simulator of iteration ${replay.simulator}`;
  const element = h("div", { class: "worlds" },
    worldPanel(replay.simulation, simulated, "This controller evolved in reality itself."),
    worldPanel(replay.reality, "In reality", isPhysical ? "Reality is a robot on a bench, whose motion is measured, not computed."
      : "The archive of this experiment does not contain reality's parameters."));
  return { element, draw, canvases: stages.map(({ canvas }) => canvas) };
}

/**
 * @param {string} title
 * @param {string} summary
 * @param {HTMLElement} content
 */
function panel(title, summary, content) {
  return h("section", { class: "world" }, h("h2", {}, title, summary ? h("span", { class: "note" }, ` ${summary}`) : null), content);
}

/**
 * Return the path of a base over the ground without its sway.
 *
 * @param {number[][]} positions
 * @returns {Page.Vector[]}
 */
export function smoothed(positions) {
  return positions.map((_, frame) => {
    const around = positions.slice(Math.max(0, frame - SMOOTHING), frame + SMOOTHING + 1);
    return [0, 1].map((k) => around.reduce((sum, position) => sum + position[k], 0) / around.length);
  });
}

/**
 * Return the point between the bases, and how much farther away the camera must be to see them all.
 *
 * @param {Page.Vector[][]} paths
 * @param {number[]} timesS
 * @param {number} time
 * @param {number} height that the camera looks at
 */
function between(paths, timesS, time, height) {
  const [frame, share] = frameAt(timesS, time);
  const bases = paths.map((path) => [0, 1].map((k) => path[frame][k] * (1 - share) + (path[frame + 1] ?? path[frame])[k] * share));
  const [x, y] = [0, 1].map((k) => bases.reduce((sum, base) => sum + base[k], 0) / (bases.length || 1));
  const apart = Math.max(0, ...bases.map((base) => Math.hypot(base[0] - x, base[1] - y)));
  return { target: [x, y, height], further: 2.2 * apart };
}
