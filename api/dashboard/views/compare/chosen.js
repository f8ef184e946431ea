// @ts-check
/** The experiments that are compared, each with its letter and a button that removes it. */

import { byId, h, refill } from "../../lib/dom.js";
import { fixed, fromBefore } from "../../lib/format.js";
import { stateBadge } from "../../lib/state_badge.js";
import { letter } from "./pair_tables.js";

/**
 * Return the list of the chosen experiments, in the order of the figure's legend.
 *
 * @param {Page.CompareView} view
 * @returns {Page.Updatable}
 */
export function chosenList(view) {
  const { cache } = view;
  const list = h("ul", { class: "chosen", "aria-label": "Experiments that are compared" });
  const removeAll = h("button", { type: "button", class: "quiet small", onclick: () => view.change({ experiments: [] }) }, "Remove all");
  const element = h("div", { class: "choice" }, list, removeAll);
  const remove = async (/** @type {string} */ id) => {
    const index = view.choice.experiments.indexOf(id);
    await view.change({ experiments: view.choice.experiments.filter((other) => other !== id) });
    const buttons = list.querySelectorAll("button");
    (buttons[Math.min(index, buttons.length - 1)] ?? byId("chooser")).focus();
  };
  const item = (/** @type {string} */ id, /** @type {number} */ index) => {
    const experiment = cache.get(id);
    const study = cache.studyName(id);
    const name = experiment
      ? h("a", { href: `#/experiments/${id}`, title: study }, cache.nameOf(id))
      : h("span", { class: "failed" }, cache.isMissing(id) ? `There is no experiment ${id}` : id);
    const button = h("button", { type: "button", class: "link", "aria-label": `Remove ${cache.nameOf(id)}`, onclick: () => remove(id) }, "✕");
    return h("li", {}, h("b", {}, letter(index)), name, study && areOfSeveralStudies(view) ? h("small", {}, study) : null,
      experiment ? stateBadge(experiment.state, experiment.caveat) : null, experiment?.fitness ? fitnessText(experiment.fitness) : null, button);
  };
  const update = () => {
    const { experiments } = view.choice;
    element.hidden = !experiments.length;
    removeAll.hidden = experiments.length < 2;
    const key = JSON.stringify(experiments.map((id) => [id, cache.get(id)?.state, cache.get(id)?.caveat, cache.get(id)?.fitness, cache.isMissing(id), cache.nameOf(id)]));
    refill(list, key, () => experiments.map(item));
  };
  return { element, update };
}

/** @param {Api.FitnessRead} fitness */
const fitnessText = ({ mean, evaluations, known }) => h("small", {}, `${fixed(mean)} after ${evaluations}${fromBefore(known)}`);

/** @param {Page.CompareView} view */
const areOfSeveralStudies = ({ cache, choice }) => new Set(choice.experiments.map((id) => cache.get(id)?.study ?? id)).size > 1;
