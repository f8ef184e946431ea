/** What may be asked of a study: each verb goes to all of its experiments that permit it. */

import { post } from "../../lib/api.js";
import { ask } from "../../lib/dialog.js";
import { h } from "../../lib/dom.js";
import { count } from "../../lib/format.js";
import { PERMITTED } from "../experiment/verbs.js";

const CONFLICT = 409;

const VERBS = [
  ["pause", "Pause", "paused"], ["resume", "Resume", "resumed"], ["stop", "Stop…", "stopped"],
  ["cancel", "Cancel…", "cancelled"], ["extend", "Extend…", "extended"],
];

/** The experiments that permit the verb. */
const willing = (study, verb) => study.experiments.filter((each) => PERMITTED[verb].includes(each.state));

/** The buttons, and `update()` for when states are others. A refused one can be reached, and says why. */
export function verbs(page) {
  const said = h("p", { class: "said", role: "status" });
  const refusal = (verb, done) => {
    const states = PERMITTED[verb].join(" or ").toLowerCase();
    return willing(page.study, verb).length ? "" : `None of its experiments can be ${done} now: only one that is ${states} can.`;
  };
  const press = async (verb, done) => {
    said.textContent = refusal(verb, done);
    if (said.textContent) return;
    try {
      await ways[verb](page);
    } catch (error) {
      said.textContent = error.message;
    }
  };
  const buttons = VERBS.map(([verb, words, done]) =>
    [h("button", { type: "button", class: "quiet", dataset: { verb }, onclick: () => press(verb, done) }, words), verb, done]);
  const update = () => {
    for (const [button, verb, done] of buttons) {
      const why = refusal(verb, done);
      button.setAttribute("aria-disabled", String(Boolean(why)));
      button.title = why;
    }
  };
  const group = h("div", { role: "group", "aria-label": "Ask of this study" }, ...buttons.map(([button]) => button));
  return { element: h("div", { class: "verbs" }, group, said), update };
}

const ways = { pause: (page) => tell(page, "pause"), resume: (page) => tell(page, "resume"), stop, cancel, extend };

async function tell(page, verb) {
  await post(`/studies/${page.id}/${verb}`);
  await page.look();
}

const which = (page, verb) => {
  const some = willing(page.study, verb).length;
  return some === page.study.experiments.length ? "All of its experiments" : `${count(some)} of its ${count(page.study.experiments.length)} experiments`;
};

function stop(page) {
  ask({
    title: "Stop this study?",
    words: `${which(page, "stop")} end: running repetitions finish their step, then each is completed with what is there. `
      + "One that has no point of its curve yet ends as cancelled.",
    action: "Stop it", danger: true, act: () => tell(page, "stop"),
  }, page.signal);
}

function cancel(page) {
  ask({
    title: "Cancel this study?",
    words: `${which(page, "cancel")} are called off at once, and the steps under way are thrown away. What is stored stays, but they can never go on.`,
    action: "Cancel it", danger: true, act: () => tell(page, "cancel"),
  }, page.signal);
}

/** Experiments are extended one by one; the direct baseline has no iterations to add, and one that is large enough is left alone. */
async function enlarge(some, wanted) {
  const refused = [];
  for (const { id, strategy, spec } of some) {
    const total = (name) => Math.max(spec[name], Number(wanted[name]));
    const iterations = strategy === "direct" ? {} : { iterations: total("iterations") };
    try {
      await post(`/experiments/${id}/extend`, { ...iterations, repetitions: total("repetitions") });
    } catch (error) {
      if (error.status !== CONFLICT) throw error;
      refused.push(error);
    }
  }
  if (refused.length === some.length) throw refused[0];
}

function extend(page) {
  const some = willing(page.study, "extend");
  const iterations = Math.max(...some.map((each) => each.spec.iterations));
  const repetitions = Math.max(...some.map((each) => each.spec.repetitions));
  const whole = { type: "number", required: true, step: 1 };
  ask({
    title: "Extend this study",
    words: `${which(page, "extend")} become as large as this, in all. What is there stands, and the whole is as if it had been `
      + "submitted so. One that is larger already stays as it is.",
    fields: [
      { name: "iterations", label: "Iterations in all", value: iterations, min: 1, max: 1000, ...whole },
      { name: "repetitions", label: "Repetitions in all", value: repetitions, min: 1, max: 10000, ...whole },
    ],
    action: "Extend it",
    act: async (values) => {
      await enlarge(some, values);
      await page.look();
    },
  }, page.signal);
}
