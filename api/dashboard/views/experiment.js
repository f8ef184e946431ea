/** An experiment, live: how far it is, what came out of it, and what may be asked of it. */

import { get, tagged } from "../lib/api.js";
import { h } from "../lib/dom.js";
import { follow } from "../lib/live.js";
import { sections } from "../lib/sections.js";
import { tabs } from "../lib/tabs.js";
import { feed } from "./experiment/feed.js";
import { figures, isDirect } from "./experiment/figures.js";
import { head } from "./experiment/head.js";
import { misfit } from "./experiment/misfit.js";
import { provenance } from "./experiment/provenance.js";
import { repetitions } from "./experiment/repetitions.js";
import { samples } from "./experiment/samples.js";
import { spec } from "./experiment/spec.js";

const LOOK_EVERY_MS = 15_000;  // time passes without events too, and what is left of it is shown

/** Fill `root` with the experiment that `parameters` name, until `signal`. */
export async function show(root, parameters, signal) {
  const id = parameters.get("id");
  const { latest } = await get("/events/page", { experiment: id, limit: 1 }, signal);
  const found = await tagged(`/experiments/${id}`, signal);
  const page = { id, signal, latest, experiment: found.value, tag: found.tag, parts: sections(signal) };
  const top = head(page);
  page.take = ({ value, tag }) => {
    Object.assign(page, { experiment: value, tag });
    top.update();
  };
  page.look = async () => page.take(await tagged(`/experiments/${id}`, signal));
  const drawn = figures(page);
  root.replaceChildren(
    top.element,
    h("div", { class: "stage" }, drawn.curve, feed(page)),
    ...drawn.others,
    tabs("Details", panels(page), parameters.get("tab"), (name) => history.replaceState(null, "", `#/experiments/${id}?tab=${name}`)),
  );
  keepUp(page);
}

function panels(page) {
  const entries = [["repetitions", "Repetitions", repetitions(page)], ["samples", "Real-world samples", samples(page)]];
  if (!isDirect(page.experiment)) entries.push(["misfit", "Misfit", misfit(page)]);
  return [...entries, ["provenance", "Provenance", provenance(page)], ["spec", "Spec", spec(page)]];
}

/** Whatever happens to the experiment is seen; so is an end that came while nobody listened. */
function keepUp(page) {
  const changed = async (events) => {
    page.parts.tell(events);
    const before = page.experiment.state;
    await page.look();
    if (page.experiment.state !== before) page.parts.tell([]);
  };
  follow({ experiment: page.id, after: page.latest }, changed, page.signal);
  const timer = setInterval(() => page.look().catch(() => {}), LOOK_EVERY_MS);
  page.signal.addEventListener("abort", () => clearInterval(timer));
}
