// @ts-check
/** Pictures of robots, which the service draws. */

import { getFile } from "./api.js";
import { h } from "./dom.js";
import { readableName } from "./format.js";
import { isDark, onTheme } from "./theme.js";

/** @type {Map<string, Promise<string>>} the address of each picture that was loaded, by robot and theme */
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
    const theme = isDark() ? "dark" : "light";
    const path = `/catalogue/robots/${encodeURIComponent(robot.name)}/picture`;
    const key = `${robot.name} ${theme}`;
    const loading = addresses.get(key) ?? getFile(path, { theme, width: 640 }).then((file) => URL.createObjectURL(file));
    addresses.set(key, loading);
    try {
      const address = await loading;
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
