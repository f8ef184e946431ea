// @ts-check
/** What believed simulators expect of a controller, in words. */

import { number } from "../format.js";

/**
 * Return the expectations, one a line.
 *
 * @param {Api.Safety} safety
 * @param {string} unit of fitness
 */
export function expectations({ simulators, failed, falls, unknown, ...worst }, unit) {
  const of = `${simulators} simulator${simulators === 1 ? "" : "s"}`;
  const { fitness_low: low, fitness_high: high } = worst;
  return [
    low === null || high === null ? null : `${of} expect${simulators === 1 ? "s" : ""} ${low === high ? number(low) : `${number(low)} to ${number(high)}`} ${unit}`.trim(),
    failed ? `The physics fails in ${failed} of ${of}` : null,
    falls ? `It falls in ${falls} of ${of}` : null,
    greatest("Greatest joint speed", worst.joint_speed, "rad/s"),
    greatest("Greatest torque", worst.torque, "N·m"),
    greatest("Greatest tilt", worst.tilt === null ? null : (180 / Math.PI) * worst.tilt, "°"),
    greatest("Least height of the base", worst.height, "m"),
    greatest("Least clearance of the base", worst.clearance, "m"),
    ...unknown.map((words) => `Not known: ${words}`),
  ].filter((line) => line !== null);
}

/** @type {(name: string, value: number | null, unit: string) => string | null} */
const greatest = (name, value, unit) => (value === null ? null : `${name}: ${number(Number(value.toPrecision(3)))} ${unit}`);
