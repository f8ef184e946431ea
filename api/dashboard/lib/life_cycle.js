// @ts-check
/** The actions on experiments and studies: in which states the service permits them, and their buttons. */

import { h } from "./dom.js";

/** @typedef {"pause" | "resume" | "stop" | "cancel" | "extend" | "retry"} Action */

/**
 * The states of an experiment in which an action is permitted, as gaplab.schemas.lifecycle has them.
 *
 * @type {Record<Action, Api.State[]>}
 */
export const PERMITTED = {
  pause: ["QUEUED", "RUNNING", "WAITING"],
  resume: ["PAUSING", "PAUSED"],
  stop: ["QUEUED", "RUNNING", "WAITING", "PAUSING", "PAUSED"],
  cancel: ["QUEUED", "RUNNING", "WAITING", "PAUSING", "PAUSED", "STOPPING"],
  extend: ["COMPLETED"],
  retry: ["QUEUED", "RUNNING", "WAITING", "PAUSED", "COMPLETED", "FAILED"],
};

/** @type {Record<Action, string>} */
const LABELS = { pause: "Pause", resume: "Resume", stop: "Stop…", cancel: "Cancel…", extend: "Extend…", retry: "Retry" };

/** @type {Record<Action, string>} */
export const PARTICIPLES = { pause: "paused", resume: "resumed", stop: "stopped", cancel: "cancelled", extend: "extended", retry: "retried" };

/**
 * Return whether the service permits an action on an experiment: only one with a failed repetition can be retried.
 *
 * @param {Action} action
 * @param {{ state: Api.State, progress: { failed: number } }} experiment
 */
export const isPermitted = (action, { state, progress }) => PERMITTED[action].includes(state) && (action !== "retry" || progress.failed > 0);

/**
 * Return the states in which an action is permitted: `queued or running`.
 *
 * @param {Action} action
 */
export function permittedStates(action) {
  const states = PERMITTED[action].map((state) => state.toLowerCase());
  return states.length > 1 ? `${states.slice(0, -1).join(", ")} or ${states.at(-1)}` : states[0];
}

/**
 * Return the buttons of the actions. One that is refused can still be reached, and says why.
 *
 * @param {string} label
 * @param {(action: Action) => string} refusal why an action is refused now, or the empty text
 * @param {Record<Action, () => unknown>} run what each action does; an error is shown beside the buttons
 * @param {{ label: string, press: () => void }[]} [others] buttons that are never refused
 * @returns {Page.Updatable}
 */
export function actionButtons(label, refusal, run, others = []) {
  const message = h("p", { class: "outcome", role: "status" });
  const press = async (/** @type {Action} */ action) => {
    message.textContent = refusal(action);
    if (message.textContent) return;
    try {
      await run[action]();
    } catch (error) {
      message.textContent = error.message;
    }
  };
  const actions = /** @type {Action[]} */ (Object.keys(LABELS));
  const buttons = new Map(actions.map((action) => {
    const button = h("button", { type: "button", class: "quiet", dataset: { action }, onclick: () => press(action) }, LABELS[action]);
    return [action, button];
  }));
  const otherButtons = others.map((other) => {
    const pressOther = () => {
      message.textContent = "";
      other.press();
    };
    return h("button", { type: "button", class: "quiet", onclick: pressOther }, other.label);
  });
  const update = () => {
    for (const [action, button] of buttons) {
      const reason = refusal(action);
      button.setAttribute("aria-disabled", String(Boolean(reason)));
      button.title = reason;
    }
  };
  const group = h("div", { role: "group", "aria-label": label }, ...buttons.values(), ...otherButtons);
  return { element: h("div", { class: "life-cycle" }, group, message), update };
}
