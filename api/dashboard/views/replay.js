/** A replay: one controller in its simulator and in reality, from the same start, on one timeline. */

import { get, search } from "../lib/api.js";
import { h } from "../lib/dom.js";
import { number, spoken } from "../lib/format.js";
import { empty, failed, loading } from "../lib/states.js";
import { choices } from "./replay/choices.js";
import { gait } from "./replay/gait.js";
import { player } from "./replay/player.js";
import { worlds } from "./replay/worlds.js";

/** Fill `root` with the replay that `parameters` ask for, until `signal`. */
export async function show(root, parameters, signal) {
  const id = parameters.get("experiment");
  if (!id) {
    const lists = h("a", { href: "#/", class: "button" }, "Choose an experiment");
    root.replaceChildren(h("h1", {}, "Replay"), empty("A replay is of one controller of one experiment; its page has the list of them.", lists));
    return;
  }
  const experiment = await get(`/experiments/${id}`, {}, signal);
  const asked = { experiment: id, repetition: 0, iteration: last(experiment), kind: "transfer", simulator: null };
  for (const key of ["repetition", "iteration", "simulator"]) if (parameters.get(key)) asked[key] = Number(parameters.get(key));
  if (parameters.get("kind") === "sample") asked.kind = "sample";
  const place = h("div", { class: "replay" });
  let shown = null;
  const load = async () => {
    shown?.abort();
    shown = new AbortController();
    signal.addEventListener("abort", () => shown.abort(), { once: true });
    history.replaceState(null, "", `#/replay${search(asked)}`);
    await fill(place, asked, shown.signal);
  };
  root.replaceChildren(
    h("h1", {}, "Replay"),
    h("p", { class: "note" }, h("a", { href: `#/experiments/${id}` }, experiment.name), ` · ${spoken(experiment.strategy)} · one controller in two worlds, from the same start`),
    choices(experiment, asked, load), place,
  );
  await load();
}

/** The last iteration that is sure to be there: the first repetition may have got no farther. */
function last({ progress, spec, strategy }) {
  if (strategy === "direct") return 0;
  return Math.max(0, Math.min(spec.iterations, Math.floor(progress.iterations_done / progress.repetitions) - 1));
}

async function fill(place, asked, signal) {
  place.replaceChildren(loading("The physics are computed anew…"));
  try {
    const { experiment, ...query } = asked;
    const replay = await get(`/experiments/${experiment}/replay`, query, signal);
    if (signal.aborted) return;
    const stages = worlds(replay, signal);
    const timeline = player(replay.times_s.at(-1), (time) => { stages.draw(time); steps.cursor(time); }, signal);
    const steps = gait(asked, replay, (time) => timeline.to(time), signal);
    place.replaceChildren(stages.element, timeline.element, differing(replay), steps.element);
    timeline.begin();
  } catch (error) {
    if (signal.aborted) return;
    const again = () => fill(place, asked, signal);
    const wait = h("button", { type: "button", class: "quiet", onclick: again }, "Look again");
    place.replaceChildren(error.status === 409 ? empty(`${error.message[0].toUpperCase()}${error.message.slice(1)}.`, wait) : failed(error, again, "h2"));
  }
}

/** A word of warning where what is seen is not what was stored: other versions of an engine compute other numbers. */
function differing({ simulation, reality, unit }) {
  const differs = [["its simulator", simulation], ["reality", reality]].filter(([, world]) => world && world.recorded !== null && world.fitness !== world.recorded);
  return differs.map(([where, { fitness, recorded }]) =>
    h("p", { class: "note warned" }, `In ${where}, ${number(recorded)} ${unit} was recorded, and ${number(fitness)} ${unit} is seen here: this machine computes other numbers than the one of then.`));
}
