/** A study, live: how far it is, its curves, its experiments, and what may be asked of it. */

import { get, tagged } from "../lib/api.js";
import { bandChoice } from "../lib/bands.js";
import { h } from "../lib/dom.js";
import { figureFiles } from "../lib/downloads.js";
import { follow } from "../lib/live.js";
import { plot } from "../lib/plot.js";
import { lines } from "./study/calls.js";
import { experiments } from "./study/experiments.js";
import { head } from "./study/head.js";

const LOOK_EVERY_MS = 15_000;  // time passes without events too, and what is left of it is shown
const DRAWN = new Set(["probed", "completed", "failed", "cancelled", "extended", "imported"]);

/** Fill `root` with the study that `parameters` name, until `signal`. */
export async function show(root, parameters, signal) {
  const id = parameters.get("id");
  const { latest } = await get("/events/page", { limit: 1 }, signal);
  const [found, catalogue] = await Promise.all([tagged(`/studies/${id}`, signal), get("/catalogue", {}, signal)]);
  const units = Object.fromEntries(catalogue.robots.map((each) => [each.name, each.details.unit]));
  const page = { id, signal, study: found.value, tag: found.tag, unit: (experiment) => units[experiment.spec.robot.name] ?? "" };
  const top = head(page);
  const below = experiments(page);
  page.take = ({ value, tag }) => {
    Object.assign(page, { study: value, tag });
    top.update();
    below.update();
  };
  page.look = async () => page.take(await tagged(`/studies/${id}`, signal));
  const drawn = curves(page);
  root.replaceChildren(top.element, drawn.element, below.element, lines(page));
  follow({ study: id, after: latest }, async (events) => {
    if (!events.length || events.some((each) => DRAWN.has(each.kind))) drawn.refresh();
    await page.look();
  }, signal);
  const timer = setInterval(() => page.look().catch(() => {}), LOOK_EVERY_MS);
  signal.addEventListener("abort", () => clearInterval(timer));
}

/** The paper's Fig. 4 of this study, with what is drawn around each curve and behind it. */
function curves({ id, signal, study }) {
  const place = h("div");
  let query = { study: id };
  const refresh = plot(place, "curves", query, signal);
  const draw = (change) => {
    query = { ...query, ...change };
    refresh(query);
  };
  const band = bandChoice({ onchange: () => draw({ band: band.value }) });
  const each = h("input", { type: "checkbox", onchange: () => draw({ each: each.checked || null }) });
  const options = h("p", { class: "options" }, h("label", {}, each, " Each repetition"), h("label", {}, "Band ", band));
  const element = h("section", { class: "card", "aria-labelledby": "curves-of" },
    h("div", { class: "titled" }, h("h2", { id: "curves-of" }, "Curves"), options), place,
    figureFiles("curves", { study: id }, `gaplab-${study.id}-curves`, ["CSV", `/studies/${id}/curves`, { format: "csv" }, `gaplab-${study.id}-curves.csv`]));
  return { element, refresh: () => refresh(query) };
}
