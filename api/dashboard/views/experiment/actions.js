// @ts-check
/** The actions on an experiment; those that its state forbids say why. */

import { patch, post } from "../../lib/api.js";
import { confirmingCost } from "../../lib/cost.js";
import { openDialog } from "../../lib/dialog.js";
import { actionButtons, isPermitted, PARTICIPLES, permittedStates } from "../../lib/life_cycle.js";

/** @typedef {import("../../lib/life_cycle.js").Action} Action */

/**
 * Return why an action on an experiment is refused, or the empty text.
 *
 * @param {Action} action
 * @param {{ state: Api.State, progress: { failed: number } }} experiment
 */
export function refusal(action, experiment) {
  if (isPermitted(action, experiment)) return "";
  const { state } = experiment;
  if (action === "retry" && !experiment.progress.failed) return "None of its repetitions has failed, so none can be retried.";
  return `An experiment that is ${state.toLowerCase()} cannot be ${PARTICIPLES[action]}, only one that is ${permittedStates(action)}.`;
}

/**
 * Return the buttons, which are updated when `page.experiment` has changed.
 *
 * @param {Page.ExperimentPage} page
 */
export const actions = (page) => actionButtons("Actions on this experiment", (action) => refusal(action, page.experiment), {
  pause: () => send(page, "pause"),
  resume: () => send(page, "resume"),
  stop: () => stop(page),
  cancel: () => cancel(page),
  extend: () => extend(page),
  retry: () => send(page, "retry"),
}, [{ label: "Change schedule…", press: () => { schedule(page); } }]);

/**
 * @param {Page.ExperimentPage} page
 * @param {Action} action
 * @param {unknown} [body]
 */
async function send(page, action, body = undefined) {
  const done = await confirmingCost((query) => post(`/experiments/${page.id}/${action}${query}`, body), page.signal);
  if (!done) throw new Error("Nothing was changed.");
  await page.reload();
}

/** @param {Page.ExperimentPage} page */
function stop(page) {
  openDialog({
    title: "Stop this experiment?",
    text: "Running repetitions finish their step, and the experiment is completed with the results it has. " +
      "If its curve has no point yet, it is cancelled instead.",
    action: "Stop it", danger: true, act: () => send(page, "stop"),
  }, page.signal);
}

/** @param {Page.ExperimentPage} page */
function cancel(page) {
  openDialog({
    title: "Cancel this experiment?",
    text: "It ends at once, and loses the steps under way. Stored results stay, but it can never go on.",
    action: "Cancel it", danger: true, act: () => send(page, "cancel"),
  }, page.signal);
}

/** @param {Page.ExperimentPage} page */
function extend(page) {
  const { level, spec } = page.experiment;
  const total = { type: "number", required: true, step: 1 };
  const iterations = { name: "iterations", label: "Iterations in all", value: spec.iterations, min: spec.iterations, max: 1000, ...total };
  openDialog({
    title: "Extend this experiment",
    text: "Enter totals, not what to add. Results so far stay, and the experiment is then as if it had been submitted with these totals. " +
      "To finish an experiment that was stopped, keep the totals as they are.",
    fields: [
      ...(level ? [] : [iterations]),
      { name: "repetitions", label: "Repetitions in all", value: spec.repetitions, min: spec.repetitions, max: 10000, ...total },
    ],
    action: "Extend it",
    act: (values) => send(page, "extend", Object.fromEntries(Object.entries(values).map(([name, value]) => [name, Number(value)]))),
  }, page.signal);
}

/** @param {Page.ExperimentPage} page */
function schedule(page) {
  const { priority, max_parallel: maxParallel } = page.experiment;
  const whole = { type: "number", step: 1 };
  openDialog({
    title: "Change the schedule",
    text: "This changes no result, and stops nothing that runs.",
    fields: [
      { name: "priority", label: "Priority", value: priority, min: -10, max: 10, required: true, hint: "−10 to 10; the highest is computed first", ...whole },
      { name: "max_parallel", label: "Repetitions at once", value: maxParallel, min: 1, max: 10000, hint: "empty: one on every free core", ...whole },
    ],
    action: "Change it",
    act: async (values) => {
      const change = { priority: Number(values.priority), max_parallel: values.max_parallel ? Number(values.max_parallel) : null };
      await patch(`/experiments/${page.id}/schedule`, change);
      await page.reload();
    },
  }, page.signal);
}
