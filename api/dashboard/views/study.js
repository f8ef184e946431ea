// @ts-check
/** A study, live: its progress, its curves, its experiments, and the actions on all of them. */

import { get, getTagged } from "../lib/api.js";
import { curveOptions } from "../lib/curve_options.js";
import { h } from "../lib/dom.js";
import { figureDownloads } from "../lib/downloads.js";
import { follow, latestAnswers, reloadEvery } from "../lib/live.js";
import { plot } from "../lib/plot.js";
import { unitsOf } from "../lib/robots.js";
import { sections } from "../lib/sections.js";
import { ENDED } from "../lib/state_badge.js";
import { CURVE_KINDS } from "./experiment/event_words.js";
import { experiments } from "./study/experiments.js";
import { head } from "./study/head.js";
import { snippets } from "./study/snippets.js";

const RELOAD_MS = 15_000;

/**
 * Fill `root` with the study that the parameters name, until `signal`.
 *
 * @param {HTMLElement} root
 * @param {URLSearchParams} parameters
 * @param {AbortSignal} signal
 */
export async function show(root, parameters, signal) {
  const id = String(parameters.get("id"));
  const { latest } = await get("/events/page", { limit: 1 }, signal);
  const [loaded, catalogue] = await Promise.all([getTagged(`/studies/${id}`, signal), get("/catalogue", {}, signal)]);
  /** @type {Page.StudyPage} */
  const page = {
    id, signal, study: loaded.value, tag: loaded.tag, unit: unitsOf(catalogue), sections: sections(signal),
    update() {
      top.update();
      table.update();
    },
    hasEnded: () => page.study.experiments.every(({ state }) => ENDED.includes(state)),
    ...latestAnswers(() => getTagged(`/studies/${id}`, signal), ({ value, tag }) => {
      Object.assign(page, { study: value, tag });
      page.update();
    }),
  };
  const top = head(page);
  const table = experiments(page);
  root.replaceChildren(top.element, curves(page), table.element, snippets(page));
  follow({ study: id, after: latest }, async (events) => {
    page.sections.reload(events);
    await page.reload();
  }, signal);
  reloadEvery(page, RELOAD_MS);
}

/**
 * Return the figure of the curves with its options, as in the paper's Fig. 4.
 *
 * @param {Page.StudyPage} page
 */
function curves({ id, signal, sections: parts }) {
  const place = h("div");
  const downloads = h("div");
  const draw = plot(place, "curves", signal);
  const options = curveOptions();
  const load = async () => {
    const query = { study: id, ...options.query() };
    downloads.replaceChildren(figureDownloads("curves", query, `gaplab-${id}-curves`,
      ["CSV", `/studies/${id}/curves`, { format: "csv", fitness: query.fitness }, `gaplab-${id}-curves.csv`]));
    return await draw(query) ? undefined : "failed";
  };
  options.element.addEventListener("change", parts.add(place, CURVE_KINDS, load));
  return h("section", { class: "card", "aria-labelledby": "curves-title" },
    h("div", { class: "titled" }, h("h2", { id: "curves-title" }, "Curves"), options.element), place, downloads);
}
