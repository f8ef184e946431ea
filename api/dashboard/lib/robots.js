// @ts-check
/** What the catalogue says of the robots of experiments. */

import { fixed, readableName } from "./format.js";

/** @typedef {Api.ExperimentRead | undefined} Experiment */

/** Return the robot of a spec as the catalogue has it: one from a file has the name in its options. @param {Record<string, any>} spec resolved */
export const robotOf = ({ robot: { name, options } }) => /** @type {string} */ (options?.sha256 ? options.name : name);

/** Return the name of the robot of a spec as people read it. @param {Record<string, any>} spec resolved */
export const robotName = (spec) => readableName(robotOf(spec));

/**
 * Return a function that gives the unit of an experiment's fitness; the empty text if its robot is not installed.
 * @param {Api.Catalogue} catalogue
 */
export function unitsOf({ robots, tasks }) {
  const [ofRobots, ofTasks] = [robots, tasks].map((plugins) => new Map(plugins.map(({ name, details }) => [name, details.unit])));
  const unit = (/** @type {Record<string, any>} */ spec) => (spec.task ? ofTasks?.get(spec.task.name) : ofRobots?.get(robotOf(spec)));
  return (/** @type {Experiment} */ experiment) => /** @type {string} */ ((experiment && unit(experiment.spec)) ?? "");
}

/**
 * Return whether an experiment's robot is a function, whose curve is stepped through instead of a motion that is replayed.
 * @param {Api.Catalogue} catalogue
 * @param {Api.ExperimentRead} experiment
 */
export const isFunction = ({ robots }, { spec }) => robots.some(({ name, details }) => name === robotOf(spec) && details.function === true);

/** Return whether reality is a robot on a bench. @param {{ spec: Record<string, any> }} experiment */
export const isPhysical = ({ spec }) => spec.reality.kind === "physical";

/** Return whether reality is a pool of recordings. @param {{ spec: Record<string, any> }} experiment */
export const isRecorded = ({ spec }) => spec.reality.kind === "recorded";

/** Format a mean fitness; of recordings, the error that it is minus of. @param {{ spec: Record<string, any> }} experiment @param {number} mean */
export const meanText = (experiment, mean) => fixed(isRecorded(experiment) ? -mean : mean);

/** Return the engine of the simulators, and what reality is if it is something else. @param {Record<string, any>} spec resolved */
export function worldsText({ engine, reality }) {
  if (reality.kind === "physical") return `${readableName(engine.name)}, reality on the bench “${reality.bench}”`;
  if (reality.kind === "recorded") return `${readableName(engine.name)}, reality is the pool “${reality.pool.name}”`;
  return `${readableName(engine.name)}${reality.engine.name === engine.name ? "" : `, reality in ${readableName(reality.engine.name)}`}`;
}
