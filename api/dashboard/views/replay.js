// @ts-check
/** A replay: one controller in its simulator and in reality, from the same start, on one timeline. */

import { get, queryString } from "../lib/api.js";
import { h } from "../lib/dom.js";
import { figureDownloads } from "../lib/downloads.js";
import { number, readableName } from "../lib/format.js";
import { empty, failed, loading } from "../lib/placeholders.js";
import { plot } from "../lib/plot.js";
import { isPhysical } from "../lib/robots.js";
import { choices } from "./replay/choices.js";
import { gait } from "./replay/gait.js";
import { player } from "./replay/player.js";
import { recording } from "./replay/recording.js";
import { worlds } from "./replay/worlds.js";

/**
 * Fill `root` with the replay that the parameters ask for, until `signal`.
 *
 * @param {HTMLElement} root
 * @param {URLSearchParams} parameters
 * @param {AbortSignal} signal
 */
export async function show(root, parameters, signal) {
  const id = parameters.get("experiment");
  if (!id) {
    const link = h("a", { href: "#/", class: "button" }, "Choose an experiment");
    root.replaceChildren(h("h1", {}, "Replay"), empty("A replay shows one controller of one experiment. The page of an experiment lists its controllers.", link));
    return;
  }
  /** @type {Api.ExperimentRead} */
  const experiment = await get(`/experiments/${id}`, {}, signal);
  const choice = choiceOf(experiment, parameters);
  const place = h("div", { class: "replay" });
  /** @type {AbortController | null} */
  let shown = null;
  const load = async () => {
    shown?.abort();
    const loading = shown = new AbortController();
    signal.addEventListener("abort", () => loading.abort(), { once: true });
    history.replaceState(null, "", `#/replay${queryString(choice)}`);
    await fill(place, choice, isPhysical(experiment), loading.signal);
  };
  root.replaceChildren(
    h("h1", {}, "Replay"),
    h("p", { class: "note" }, h("a", { href: `#/experiments/${id}` }, experiment.name),
      ` · ${readableName(experiment.strategy)} · ${isPhysical(experiment) ? "one controller in its simulator" : "one controller in two worlds, from the same start"}`),
    choices(experiment, choice, load), place,
  );
  await load();
}

/**
 * Return the choice in an address; left out, it is the controller of the last iteration.
 *
 * @param {Api.ExperimentRead} experiment
 * @param {URLSearchParams} parameters
 * @returns {Page.ReplayChoice}
 */
function choiceOf(experiment, parameters) {
  const numberOr = (/** @type {string} */ name, /** @type {any} */ otherwise) => (parameters.get(name) ? Number(parameters.get(name)) : otherwise);
  return {
    experiment: experiment.id,
    repetition: numberOr("repetition", 0),
    iteration: numberOr("iteration", lastIteration(experiment)),
    kind: parameters.get("kind") === "sample" ? "sample" : "transfer",
    simulator: numberOr("simulator", null),
  };
}

/**
 * Return the last iteration that is sure to be there: the first repetition may be behind the others.
 *
 * @param {Api.ExperimentRead} experiment
 */
export function lastIteration({ level, progress, spec }) {
  if (level) return 0;
  return Math.max(0, Math.min(spec.iterations, Math.floor(progress.iterations_done / progress.repetitions) - 1));
}

/**
 * @param {HTMLElement} place
 * @param {Page.ReplayChoice} choice
 * @param {boolean} isOnBench whether reality is a robot on a bench
 * @param {AbortSignal} signal
 */
async function fill(place, choice, isOnBench, signal) {
  place.replaceChildren(loading("Computing the physics again…"));
  try {
    const { experiment, ...query } = choice;
    /** @type {Api.Replay} */
    const replay = await get(`/experiments/${experiment}/replay`, query, signal);
    if (signal.aborted) return;
    const stages = worlds(replay, isOnBench, signal);
    const showTime = (/** @type {number} */ time) => {
      stages.draw(time);
      film.take(time);
      figure.moveCursor(time);
    };
    const timeline = player(replay.times_s[replay.times_s.length - 1], showTime, signal);
    const film = recording(stages.canvases, `gaplab-${experiment}-${choice.repetition}-${choice.iteration}`, timeline.playOnce, signal);
    const figure = gait(choice, (time) => timeline.goTo(time), signal);
    place.replaceChildren(stages.element, timeline.element, ...(stages.canvases.length ? [film.element] : []), ...differences(replay), figure.element,
      ...(replay.readings ? [readings(choice, signal)] : []));
    timeline.begin();
  } catch (error) {
    if (signal.aborted) return;
    const again = () => fill(place, choice, isOnBench, signal);
    const button = h("button", { type: "button", class: "quiet", onclick: again }, "Try again");
    place.replaceChildren(error.status === 409 ? empty(`${error.message[0].toUpperCase()}${error.message.slice(1)}.`, button) : failed(error, again, "h2"));
  }
}

/**
 * Return the figure of what the sensors said in reality, and say in the simulator.
 *
 * @param {Page.ReplayChoice} choice
 * @param {AbortSignal} signal
 */
function readings(choice, signal) {
  const place = h("div");
  plot(place, "readings", signal)(choice);
  const downloads = figureDownloads("readings", choice, `gaplab-${choice.experiment}-readings`);
  return h("section", { class: "card" }, h("h2", {}, "Readings of the sensors"), place, downloads);
}

/**
 * Return a warning for each world whose fitness differs from the stored one: other versions of an engine compute other numbers.
 *
 * @param {Api.Replay} replay
 */
function differences({ simulation, reality, unit }) {
  return [{ place: "its simulator", world: simulation }, { place: "reality", world: reality }].flatMap(({ place, world }) => {
    if (!world || world.recorded === null || world.fitness === world.recorded) return [];
    const text = `In ${place}, the stored fitness is ${number(world.recorded)} ${unit}, and this replay reaches ${number(world.fitness)} ${unit}: `
      + "this machine computes other numbers than the one that stored it.";
    return [h("p", { class: "note warned" }, text)];
  });
}
