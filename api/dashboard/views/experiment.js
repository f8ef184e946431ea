// @ts-check
/** An experiment, live: its progress, its results, and the actions on it. */

import { keepAges } from "../lib/ages.js";
import { get, getTagged } from "../lib/api.js";
import { h } from "../lib/dom.js";
import { follow, latestAnswers, reloadEvery } from "../lib/live.js";
import { sections } from "../lib/sections.js";
import { ENDED } from "../lib/state_badge.js";
import { tabs } from "../lib/tabs.js";
import { showBenchLink } from "../lib/bench/link.js";
import { isFunction, isPhysical, unitsOf } from "../lib/robots.js";
import { branches } from "./experiment/branches.js";
import { eventList } from "./experiment/event_list.js";
import { curve, otherFigures } from "./experiment/figures.js";
import { head } from "./experiment/head.js";
import { measurements } from "./experiment/measurements.js";
import { misfit } from "./experiment/misfit.js";
import { provenance } from "./experiment/provenance.js";
import { repetitions } from "./experiment/repetitions.js";
import { samples } from "./experiment/samples.js";
import { spec } from "./experiment/spec.js";

const RELOAD_MS = 15_000;

/**
 * Fill `root` with the experiment that the parameters name, until `signal`.
 *
 * @param {HTMLElement} root
 * @param {URLSearchParams} parameters
 * @param {AbortSignal} signal
 */
export async function show(root, parameters, signal) {
  const id = String(parameters.get("id"));
  const { latest } = await get("/events/page", { experiment: id, limit: 1 }, signal);
  const [loaded, catalogue] = await Promise.all([getTagged(`/experiments/${id}`, signal), get("/catalogue", {}, signal)]);
  /** @type {Page.ExperimentPage} */
  const page = {
    id, signal, latest, experiment: loaded.value, tag: loaded.tag, isFunction: isFunction(catalogue, loaded.value), unit: unitsOf(catalogue), sections: sections(signal),
    update: () => top.update(),
    hasEnded: () => ENDED.includes(page.experiment.state),
    ...latestAnswers(() => getTagged(`/experiments/${id}`, signal), ({ value, tag }) => {
      const isMoved = value.state !== page.experiment.state;
      Object.assign(page, { experiment: value, tag });
      page.update();
      if (isMoved) page.sections.reload([]);  // what they say may depend on the state
    }),
  };
  const top = head(page);
  if (isPhysical(page.experiment)) showBenchLink();
  const rememberTab = (/** @type {string} */ name) => history.replaceState(null, "", `#/experiments/${id}?tab=${name}`);
  root.replaceChildren(
    top.element,
    h("div", { class: "stage" }, curve(page), eventList(page)),
    ...otherFigures(page),
    tabs("Details", panels(page), parameters.get("tab"), rememberTab),
  );
  keepAges(root, signal);
  keepUp(page);
}

/**
 * @param {Page.ExperimentPage} page
 * @returns {Parameters<typeof tabs>[1]}
 */
function panels(page) {
  const misfitPanel = page.experiment.level ? [] : [/** @type {[string, string, Page.Child]} */ (["misfit", "Misfit", misfit(page)])];
  /** @type {Parameters<typeof tabs>[1]} */
  const real = isPhysical(page.experiment) ? [["samples", "Measurements", measurements(page)], ["branches", "Closed branches", branches(page)]]
    : [["samples", "Real-world samples", samples(page)]];
  return [
    ["repetitions", "Repetitions", repetitions(page)],
    ...real,
    ...misfitPanel,
    ["provenance", "Provenance", provenance(page)],
    ["spec", "Spec", spec(page)],
  ];
}

/**
 * Reload what events change.
 *
 * @param {Page.ExperimentPage} page
 */
function keepUp(page) {
  const refresh = async (/** @type {Page.ServerEvent[]} */ events) => {
    page.sections.reload(events);
    await page.reload();
  };
  follow({ experiment: page.id, after: page.latest }, refresh, page.signal);
  reloadEvery(page, RELOAD_MS);
}
