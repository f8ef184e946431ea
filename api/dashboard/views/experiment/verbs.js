/** What may be asked of an experiment: the verbs, those that its state forbids with the reason. */

import { patch, post } from "../../lib/api.js";
import { ask } from "../../lib/dialog.js";
import { h } from "../../lib/dom.js";

/** As schemas.lifecycle has it. */
export const PERMITTED = {
  pause: ["QUEUED", "RUNNING"],
  resume: ["PAUSING", "PAUSED"],
  stop: ["QUEUED", "RUNNING", "PAUSING", "PAUSED"],
  cancel: ["QUEUED", "RUNNING", "PAUSING", "PAUSED", "STOPPING"],
  extend: ["COMPLETED"],
};

const ASKED = { pause: "Pause", resume: "Resume", stop: "Stop…", cancel: "Cancel…", extend: "Extend…" };
const DONE = { pause: "paused", resume: "resumed", stop: "stopped", cancel: "cancelled", extend: "extended" };

/** Why the verb is refused now, or nothing. */
export function refusal(verb, state) {
  if (PERMITTED[verb].includes(state)) return null;
  return `An experiment that is ${state.toLowerCase()} cannot be ${DONE[verb]}, only one that is ${listed(PERMITTED[verb])}.`;
}

function listed(states) {
  const words = states.map((each) => each.toLowerCase());
  return words.length > 1 ? `${words.slice(0, -1).join(", ")} or ${words.at(-1)}` : words[0];
}

/** The buttons, and `update()` for when the state is another. A refused one can be reached, and says why. */
export function verbs(page) {
  const said = h("p", { class: "said", role: "status" });
  const press = (verb) => {
    const why = refusal(verb, page.experiment.state);
    said.textContent = why ?? "";
    if (!why) ways[verb](page, said);
  };
  const buttons = Object.entries(ASKED).map(([verb, words]) =>
    h("button", { type: "button", class: "quiet", dataset: { verb }, onclick: () => press(verb) }, words));
  const change = () => {
    said.textContent = "";
    schedule(page);
  };
  const turn = h("button", { type: "button", class: "quiet", dataset: { verb: "schedule" }, onclick: change }, "Change its turn…");
  const update = () => {
    for (const button of buttons) {
      const why = refusal(button.dataset.verb, page.experiment.state);
      button.setAttribute("aria-disabled", String(Boolean(why)));
      button.title = why ?? "";
    }
  };
  const group = h("div", { role: "group", "aria-label": "Ask of this experiment" }, ...buttons, turn);
  return { element: h("div", { class: "verbs" }, group, said), update };
}

const ways = { pause: atOnce("pause"), resume: atOnce("resume"), stop, cancel, extend };

/** What can be taken back is done without a question. */
function atOnce(verb) {
  return async (page, said) => {
    try {
      await tell(page, verb);
    } catch (error) {
      said.textContent = error.message;
    }
  };
}

async function tell(page, verb, body = undefined) {
  await post(`/experiments/${page.id}/${verb}`, body);
  await page.look();
}

function stop(page) {
  ask({
    title: "Stop this experiment?",
    words: "Running repetitions finish their step, then it is completed with what is there. " +
      "If no repetition has a point of the curve yet, it ends as cancelled.",
    action: "Stop it", danger: true, act: () => tell(page, "stop"),
  }, page.signal);
}

function cancel(page) {
  ask({
    title: "Cancel this experiment?",
    words: "It is called off at once, and the steps under way are thrown away. What is stored stays, but it can never go on.",
    action: "Cancel it", danger: true, act: () => tell(page, "cancel"),
  }, page.signal);
}

function extend(page) {
  const { iterations, repetitions } = page.experiment.spec;
  const whole = { type: "number", required: true, step: 1 };
  ask({
    title: "Extend this experiment",
    words: "Totals, not what is added. What is there stands, and the whole is as if it had been submitted so. " +
      "With the totals that it has, one that was stopped is brought to its end.",
    fields: [
      { name: "iterations", label: "Iterations in all", value: iterations, min: iterations, max: 1000, ...whole },
      { name: "repetitions", label: "Repetitions in all", value: repetitions, min: repetitions, max: 10000, ...whole },
    ],
    action: "Extend it",
    act: (values) => tell(page, "extend", { iterations: Number(values.iterations), repetitions: Number(values.repetitions) }),
  }, page.signal);
}

function schedule(page) {
  const { priority, max_parallel: most } = page.experiment;
  const whole = { type: "number", step: 1 };
  ask({
    title: "Change its turn",
    words: "This changes no number, and stops nothing that runs.",
    fields: [
      { name: "priority", label: "Priority", value: priority, min: -10, max: 10, required: true, hint: "−10 to 10; the higher is computed first", ...whole },
      { name: "most", label: "Repetitions at once", value: most, min: 1, max: 10000, hint: "empty: as many as have a core", ...whole },
    ],
    action: "Change it",
    act: async (values) => {
      const change = { priority: Number(values.priority), max_parallel: values.most ? Number(values.most) : null };
      await patch(`/experiments/${page.id}/schedule`, change);
      await page.look();
    },
  }, page.signal);
}
