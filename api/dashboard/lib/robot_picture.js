// @ts-check
/** Pictures of robots as they stand at the start, drawn as replays are. */

import { get } from "./api.js";
import { h } from "./dom.js";
import { readableName } from "./format.js";
import { camera } from "./replay/camera.js";
import { colours } from "./replay/colours.js";
import { bodyPoses, feetOnGround, shapePoses } from "./replay/motion.js";
import { painterOf } from "./replay/stage.js";
import { isDark, onTheme } from "./theme.js";

const SIZE = { width: 640, height: 480 };

/** @type {Map<string, Promise<string>>} the address of each picture that was drawn, by robot and theme */
const addresses = new Map();

/**
 * Return the picture of a robot of the catalogue, in the colours of the page; null if the robot has no body.
 *
 * @param {Api.PluginRead | undefined} robot
 * @param {AbortSignal} signal
 */
export function robotPicture(robot, signal) {
  if (!robot?.available || !robot.details.bodies) return null;
  const image = h("img", { class: "robot-picture", alt: `The robot ${readableName(robot.name)}`, width: 320, height: 240 });
  const show = async () => {
    const key = `${robot.name} ${isDark()}`;
    const drawing = addresses.get(key) ?? get(`/catalogue/robots/${encodeURIComponent(robot.name)}/shapes`).then(draw);
    addresses.set(key, drawing);
    try {
      const address = await drawing;
      image.hidden = false;
      image.src = address;
    } catch {
      addresses.delete(key);
      image.hidden = true;  // a form without a picture is still a form
    }
  };
  onTheme(() => { if (image.isConnected) show(); }, signal);
  show();
  return image;
}

/**
 * Draw a robot in the colours that the page has now, and return the address of the picture.
 *
 * @param {Api.RobotShapes} robot
 */
async function draw(robot) {
  const canvas = h("canvas", SIZE);
  const { gl, paint } = painterOf(canvas, robot.shapes);
  const viewpoint = camera(() => {}, robot.scale).viewpoint(robot.middle_m, 0, robot.slope_rad);
  paint(shapePoses(robot, bodyPoses(robot, [0], 0)), feetOnGround(robot, 0), viewpoint, colours(), []);
  /** @type {Blob} */
  const picture = await new Promise((resolve, fail) => canvas.toBlob((blob) => (blob ? resolve(blob) : fail()), "image/png"));
  gl?.getExtension("WEBGL_lose_context")?.loseContext();  // a browser has only a few contexts
  return URL.createObjectURL(picture);
}
