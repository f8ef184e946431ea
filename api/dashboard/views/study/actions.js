// @ts-check
/** The actions on a study: each goes to all of its experiments whose state permits it. */

import { post } from "../../lib/api.js";
import { confirmingCost } from "../../lib/cost.js";
import { openDialog } from "../../lib/dialog.js";
import { count } from "../../lib/format.js";
import { actionButtons, isPermitted, PARTICIPLES, permittedStates } from "../../lib/life_cycle.js";

/** @typedef {import("../../lib/life_cycle.js").Action} Action */

/**
 * Return the buttons, which are updated when `page.study` has changed.
 *
 * @param {Page.StudyPage} page
 */
export const actions = (page) => actionButtons("Actions on this study", (action) => refusal(page.study, action), {
  pause: () => send(page, "pause"),
  resume: () => send(page, "resume"),
  stop: () => stop(page),
  cancel: () => cancel(page),
  extend: () => extend(page),
  retry: () => send(page, "retry"),
});

/**
 * @param {Api.StudyRead} study
 * @param {Action} action
 */
const permitting = (study, action) => study.experiments.filter((experiment) => isPermitted(action, experiment));

/**
 * @param {Api.StudyRead} study
 * @param {Action} action
 */
function refusal(study, action) {
  if (permitting(study, action).length) return "";
  if (action === "retry") return "None of its repetitions has failed, so none can be retried.";
  return `None of its experiments can be ${PARTICIPLES[action]} now: only one that is ${permittedStates(action)} can.`;
}

/**
 * @param {Page.StudyPage} page
 * @param {Action} action
 * @param {object} [body]
 */
async function send(page, action, body) {
  const done = await confirmingCost((query) => post(`/studies/${page.id}/${action}${query}`, body), page.signal);
  if (!done) throw new Error("Nothing was changed.");
  await page.reload();
}

/**
 * Return how many experiments an action goes to, as the subject of a sentence.
 *
 * @param {Page.StudyPage} page
 * @param {Action} action
 */
function subject({ study }, action) {
  const some = permitting(study, action).length;
  return some === study.experiments.length ? "All of its experiments" : `${count(some)} of its ${count(study.experiments.length)} experiments`;
}

/** @param {Page.StudyPage} page */
function stop(page) {
  openDialog({
    title: "Stop this study?",
    text: `${subject(page, "stop")} end: running repetitions finish their step, and each experiment is completed with the results it has. `
      + "An experiment whose curve has no point yet is cancelled instead.",
    action: "Stop it", danger: true, act: () => send(page, "stop"),
  }, page.signal);
}

/** @param {Page.StudyPage} page */
function cancel(page) {
  openDialog({
    title: "Cancel this study?",
    text: `${subject(page, "cancel")} end at once, and lose the steps under way. Stored results stay, but the experiments can never go on.`,
    action: "Cancel it", danger: true, act: () => send(page, "cancel"),
  }, page.signal);
}

/** @param {Page.StudyPage} page */
function extend(page) {
  const whole = { value: "", type: "number", min: 1, step: 1 };
  openDialog({
    title: "Extend this study",
    text: `${subject(page, "extend")} grow to these totals. Results so far stay, and the study is then as if it had been submitted `
      + "with these totals. An experiment that is larger already stays as it is. To finish experiments that were stopped, leave both empty.",
    fields: [
      { name: "iterations", label: "Iterations in all", hint: now(page, "iterations"), max: 1000, ...whole },
      { name: "repetitions", label: "Repetitions in all", hint: now(page, "repetitions"), max: 10000, ...whole },
    ],
    action: "Extend it",
    act: (values) => send(page, "extend", Object.fromEntries(
      Object.entries(values).filter(([, value]) => value).map(([name, value]) => [name, Number(value)]))),
  }, page.signal);
}

/**
 * Return the present totals of the experiments that can be extended: the direct baseline may have others.
 *
 * @param {Page.StudyPage} page
 * @param {"iterations" | "repetitions"} name
 */
function now({ study }, name) {
  const totals = permitting(study, "extend").filter(({ level }) => name === "repetitions" || !level).map(({ spec }) => spec[name]);
  const [least, most] = [Math.min(...totals), Math.max(...totals)];
  const present = totals.length ? `Now ${count(least)}${most > least ? ` to ${count(most)}` : ""}. ` : "";
  return `${present}Empty: unchanged.`;
}
