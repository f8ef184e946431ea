// @ts-check
/** A study, live: its progress, its results, and the actions on it. One experiment, alone or among others, is shown with all that it has. */

import { get, getTagged } from "../lib/api.js";
import { showBenchLink } from "../lib/bench/sender.js";
import { copyButton } from "../lib/copy.js";
import { h, keyedRows } from "../lib/dom.js";
import { every, follow, keepAges, latestAnswers } from "../lib/live.js";
import { isFunction, isPhysical, robotOf, unitsOf } from "../lib/robots.js";
import { sections } from "../lib/sections.js";
import { ENDED } from "../lib/state_badge.js";
import { framed } from "../lib/table.js";
import { tabs } from "../lib/tabs.js";
import { listRow, listTable } from "./list/rows.js";
import { selectionBar } from "./list/selection.js";
import { eventList } from "./study/events.js";
import { curves, otherFigures } from "./study/figures.js";
import { head } from "./study/head.js";
import { branches, measurements } from "./study/measurements.js";
import { misfit } from "./study/misfit.js";
import { provenance, repetitions, spec } from "./study/repetitions.js";
import { samples } from "./study/samples.js";

const RELOAD_MS = 15_000;

/**
 * Fill `root` with the study, or the one of its experiments, that the parameters name, until `signal`.
 * @param {HTMLElement} root
 * @param {URLSearchParams} parameters
 * @param {AbortSignal} signal
 */
export async function show(root, parameters, signal) {
  const id = String(parameters.get("id"));
  const load = () => getTagged(`/studies/${id}`, signal);
  const { latest } = await get("/events/page", { study: id, limit: 1 }, signal);
  const [{ value: study, tag }, catalogue] = await Promise.all([load(), get("/catalogue", {}, signal)]);
  /** @type {Page.StudyPage} */
  const page = {
    id, study, tag, latest, signal, robot: catalogue.robots.find((/** @type {Api.PluginRead} */ { name }) => name === robotOf(study.experiments[0].spec)), unit: unitsOf(catalogue), isFunction: isFunction(catalogue, study.experiments[0]), sections: sections(signal),
    get experiment() { return page.study.experiments[0]; },
    update() {
      top.update();
      table?.update();
    },
    ...latestAnswers(load, (answer) => {
      const { state, experiments: { length } } = page.study;
      Object.assign(page, { study: answer.value, tag: answer.tag });
      if (page.study.experiments.length !== length) dispatchEvent(new HashChangeEvent("hashchange"));  // perhaps one is left
      page.update();
      if (page.study.state !== state) page.sections.reload([]);  // what they say may depend on the state
    }),
  };
  const top = head(page);
  const table = study.experiments.length > 1 ? experiments(page) : null;
  if (study.experiments.some(isPhysical)) showBenchLink();
  root.replaceChildren(top.element, ...(table ? [curves(page), table.element] : ofOne(page, parameters.get("tab"))), snippets(id));
  keepAges(root, signal);
  follow({ study: id, after: latest }, async (events) => {
    page.sections.reload(events);
    await page.reload();
  }, signal);
  keepUp(page);
}

/**
 * Bring a page up to date at regular intervals: times pass without events too. Of what has ended only the ages change.
 * @param {Pick<Page.StudyPage, "study" | "signal" | "update" | "reload">} page
 */
export function keepUp(page) {
  const hasEnded = () => page.study.experiments.every(({ state }) => ENDED.includes(state));
  every(RELOAD_MS, () => { if (hasEnded()) page.update(); else page.reload().catch(() => {}); }, page.signal);
}

/**
 * Return what only one experiment has: events beside the curve, figures of its simulators, and details.
 * @param {Page.StudyPage} page
 * @param {string | null} tab the one that is open
 */
function ofOne(page, tab) {
  const { experiment } = page;
  /** @type {Parameters<typeof tabs>[1]} */
  const panels = [
    ["repetitions", "Repetitions", repetitions(page)],
    ["samples", isPhysical(experiment) ? "Measurements" : "Real-world samples", isPhysical(experiment) ? measurements(page) : samples(page)],
    ...(isPhysical(experiment) ? [/** @type {[string, string, Page.Child]} */ (["branches", "Closed branches", branches(page)])] : []),
    ...(experiment.level ? [] : [/** @type {[string, string, Page.Child]} */ (["misfit", "Misfit", misfit(page)])]),
    ["provenance", "Provenance", provenance(page)],
    ["spec", "Spec", spec(page)],
  ];
  const rememberTab = (/** @type {string} */ name) => history.replaceState(null, "", `${location.hash.split("?")[0]}?tab=${name}`);
  return [h("div", { class: "stage" }, curves(page), eventList(page)), ...otherFigures(page), tabs("Details", panels, tab, rememberTab)];
}

/** Return the experiments of a study, in rows like those of the list. @param {Page.StudyPage} page @returns {Page.Updatable} */
function experiments(page) {
  const bar = selectionBar(() => update());
  const ticked = () => {
    bar.update();
    update();
  };
  const { element, body } = listTable("Experiments", { cssClass: "flat" });
  const fill = keyedRows(body, ({ value }) => value.id, (/** @type {import("./list/rows.js").Row} */ row) => listRow(row, { unit: page.unit, ticked }));
  const update = () => fill(page.study.experiments.map((value) => ({ value, isNested: true })));
  update();
  return { element: h("section", { "aria-labelledby": "experiments-title" }, h("h2", { id: "experiments-title" }, "Experiments"), bar.element, element), update };
}

/** Return lines to copy that read a study from a terminal or a program. @param {string} id */
function snippets(id) {
  const base = new URL(".", location.href).href.replace(/\/$/, "");
  const calls = {
    curl: `curl '${base}/curves?study=${id}&format=csv'`,
    Command: `GAPLAB_URL=${base} gaplab show ${id}`,
    Python: `from gaplab import Client\n\nwith Client("${base}") as gaplab:\n    curves = gaplab.curves(["${id}"])`,
  };
  return h("details", { class: "calls" }, h("summary", {}, "From a terminal or a program"), ...Object.entries(calls).map(([title, text]) =>
    h("div", { class: "call" }, h("div", { class: "titled" }, h("h3", {}, title), copyButton("Copy", () => text)), framed(title, h("pre", {}, h("code", {}, text))))));
}
