/** The two worlds of a replay side by side, seen by one camera. */

import { h } from "../../lib/dom.js";
import { number } from "../../lib/format.js";
import { camera } from "../../lib/replay/camera.js";
import { between } from "../../lib/replay/motion.js";
import { stage } from "../../lib/replay/stage.js";
import { empty } from "../../lib/states.js";

const SMOOTH = 12;  // frames to each side over which the camera's way is levelled

/** Both stages in one `element`, and `draw(time)` for both. */
export function worlds(replay, signal) {
  const moving = [replay.simulation, replay.reality].filter((each) => each?.positions_m.length);
  const paths = moving.map((world) => level(world.positions_m));
  const looked = (time) => middle(paths, replay.times_s, time);
  const stages = [];
  const draw = (time) => stages.forEach((each) => each.draw(time));
  const shared = { camera: camera(() => stages.forEach((each) => each.draw())), looked, signal };
  const place = (world, title, absent) => {
    if (!world) return panel(title, null, empty(absent));
    if (!world.positions_m.length) return panel(title, world, empty("The physics failed: there is nothing to be seen."));
    const made = stage(world, replay.times_s, `${title}: ${words(world, replay.unit)}`, shared);
    stages.push(made);
    return panel(title, world, made.canvas, replay.unit);
  };
  const tuned = replay.simulator === null ? "In its simulator" : `In the simulator of iteration ${replay.simulator}`;
  const element = h("div", { class: "worlds" },
    place(replay.simulation, tuned, "This controller evolved in reality itself."),
    place(replay.reality, "In reality", "Reality's parameters are not in the archive that this experiment came from."));
  return { element, draw };
}

function panel(title, world, content, unit = "") {
  return h("section", { class: "world" },
    h("h2", {}, title, world ? h("span", { class: "note" }, ` ${words(world, unit)}`) : null), content);
}

const words = ({ engine, fitness }, unit) => `${fitness === null ? "no fitness" : `${number(fitness)} ${unit}`}, ${engine}`;

/** The way of a base over the ground, without its sway. */
function level(positions) {
  return positions.map((_, frame) => {
    const around = positions.slice(Math.max(0, frame - SMOOTH), frame + SMOOTH + 1);
    return [0, 1].map((k) => around.reduce((sum, each) => sum + each[k], 0) / around.length);
  });
}

/** The point between the bases, and how much farther away the camera must be to see all of them. */
function middle(paths, timesS, time) {
  const [frame, share] = between(timesS, time);
  const at = paths.map((path) => [0, 1].map((k) => path[frame][k] * (1 - share) + (path[frame + 1] ?? path[frame])[k] * share));
  const [x, y] = [0, 1].map((k) => at.reduce((sum, each) => sum + each[k], 0) / (at.length || 1));
  const apart = Math.max(0, ...at.map((each) => Math.hypot(each[0] - x, each[1] - y)));
  return { target: [x, y, 0.12], further: 2.2 * apart };
}
