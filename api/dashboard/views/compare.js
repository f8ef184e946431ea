// @ts-check
/** Any experiments in one figure, and which of them differ. */

import { copyButton } from "../lib/copy.js";
import { h } from "../lib/dom.js";
import { CURVE_KINDS } from "../lib/event_kinds.js";
import { follow } from "../lib/live.js";
import { empty } from "../lib/placeholders.js";
import { sections } from "../lib/sections.js";
import { ENDED } from "../lib/state_badge.js";
import { addressOf, comparisonOf } from "./compare/address.js";
import { experimentCache } from "./compare/cache.js";
import { chooser } from "./compare/chooser.js";
import { chosenList } from "./compare/chosen.js";
import { controls, figure } from "./compare/curves.js";
import { settings } from "./compare/settings.js";
import { significance } from "./compare/significance.js";

const KINDS = [...CURVE_KINDS, "started", "waiting", "pausing", "paused", "resumed", "stopping", "retried"];

/**
 * Fill `root` with the comparison that the address asks for, until `signal`.
 *
 * @param {HTMLElement} root
 * @param {URLSearchParams} parameters
 * @param {AbortSignal} signal
 */
export async function show(root, parameters, signal) {
  const cache = experimentCache(signal);
  const { studies, ...choice } = comparisonOf(parameters);
  /** @type {Page.CompareView} */
  const view = {
    choice, cache, signal, sections: sections(signal),
    async change(changes) {
      view.choice = { ...view.choice, ...changes };
      history.pushState(null, "", addressOf(view.choice));
      await cache.load(view.choice.experiments).catch(() => {});  // it is loaded once the service is back
      if (!signal.aborted) update();
    },
  };
  const [chosen, differing] = [chosenList(view), settings(view)];
  const shown = [controls(view), figure(view), significance(view), differing];
  const results = h("div", { class: "results" }, ...shown.map(({ element }) => element));
  const nothing = empty("Choose experiments above: one, two, or all of a study. The address then holds the comparison, to be shared.");
  const update = () => {
    const { experiments } = view.choice;
    results.hidden = !cache.known(experiments).length;
    nothing.hidden = experiments.length > 0;
    for (const part of [chosen, ...shown]) part.update();
  };
  await loadChoice(view, studies);
  root.replaceChildren(h("div", { class: "titled" }, h("h1", {}, "Compare"), copyButton("Copy the link", () => location.href)),
    chooser(view), chosen.element, differing.warnings, results, nothing);
  update();
  const refresh = async (/** @type {Page.ServerEvent[]} */ events) => {
    const { experiments } = view.choice;
    const ours = events.filter(({ data }) => experiments.includes(data.experiment));
    if (events.length && !ours.length) return;
    await cache.load(experiments);
    const changed = new Set(ours.map(({ data }) => data.experiment));
    const isOpen = (/** @type {string} */ id) => !ENDED.includes(/** @type {Api.State} */ (cache.get(id)?.state));
    await cache.reload(view.choice.experiments.filter((id) => changed.has(id) || isOpen(id)));
    view.sections.reload(ours);
    update();
  };
  follow({ kind: KINDS }, refresh, signal);
}

/**
 * Load the experiments in the address; studies in it stand for their experiments.
 *
 * @param {Page.CompareView} view
 * @param {string[]} studies
 */
async function loadChoice(view, studies) {
  const ofStudies = await Promise.all(studies.map(view.cache.loadStudy));
  const experiments = [...new Set([...view.choice.experiments, ...ofStudies.flat()])];
  view.choice = { ...view.choice, experiments };
  if (studies.length) history.replaceState(null, "", addressOf(view.choice));
  await view.cache.load(experiments);
}
