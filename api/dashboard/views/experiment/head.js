/** The head of an experiment: what it is, how far it is, and what may be asked of it. */

import { get } from "../../lib/api.js";
import { h, refill } from "../../lib/dom.js";
import { download } from "../../lib/downloads.js";
import { edit } from "../../lib/editing.js";
import { age, count, duration, spoken } from "../../lib/format.js";
import { pill } from "../../lib/pill.js";
import { fraction } from "../../lib/progress.js";
import { verbs } from "./verbs.js";

const ENDED = ["COMPLETED", "FAILED", "CANCELLED"];

/** The head's element, and `update()` for when `page.experiment` is another. */
export function head(page) {
  const title = h("h1");
  const state = h("span", { class: "state-now", role: "status" });
  const notes = h("p", { class: "notes" });
  const bar = h("progress", { max: 1, "aria-label": "Progress" });
  const facts = h("dl", { class: "facts" });
  const remarks = h("div", { class: "remarks" });
  const asked = verbs(page);
  const update = () => {
    const { experiment } = page;
    title.textContent = spoken(experiment.name);
    const far = ENDED.includes(experiment.state) ? "" : `${percent(experiment.progress)} · `;
    document.title = `${far}${title.textContent} · gaplab`;
    notes.textContent = experiment.notes ?? "";
    notes.hidden = !experiment.notes;
    refill(state, experiment.state, () => pill(experiment.state));
    bar.value = fraction(experiment.progress);
    const { progress, priority, max_parallel: most } = experiment;
    refill(facts, JSON.stringify([progress, priority, most, experiment.state, minute()]), () => factsOf(experiment));
    refill(remarks, JSON.stringify([experiment.warnings, experiment.reasons]), () => remarksOf(experiment));
    asked.update();
  };
  const change = () => edit(page, `/experiments/${page.id}`, () => page.experiment);
  const pen = h("button", { type: "button", class: "quiet small", onclick: change }, "Edit name and notes");
  update();
  const element = h("header", { class: "experiment-head" }, trail(page),
    h("div", { class: "titled" }, title, state, pen), h("p", { class: "what" }, what(page.experiment)), notes, bar, facts, remarks, asked.element, links(page));
  return { element, update };
}

const percent = (progress) => `${Math.floor(100 * fraction(progress))} %`;

/** What it is, in a line: strategy, robot, engines, what is tuned. */
function what({ strategy, spec }) {
  const own = spec.engine?.name;
  const other = spec.reality?.engine?.name;
  const engines = own && other && own !== other ? `${own}, reality in ${other}` : own;
  const tuned = (spec.tunables ?? []).map((each) => each.name.replaceAll("_", " ")).join(", ");
  const tunes = tuned && strategy !== "direct" ? `tunes ${tuned}` : null;
  return [spoken(strategy), spec.robot?.name.replaceAll("_", " "), engines, tunes].filter(Boolean).join(" · ");
}

/** Times are told in minutes and hours: what they say is put right each minute. */
const minute = () => Math.floor(Date.now() / 60_000);

function trail({ experiment, signal }) {
  if (!experiment.study) return h("nav", { "aria-label": "Place", class: "trail" }, h("a", { href: "#/" }, "Experiments"));
  const study = h("a", { href: `#/studies/${experiment.study}` }, `study ${experiment.study}`);
  get(`/studies/${experiment.study}`, {}, signal).then(({ name }) => { study.textContent = name; }, () => {});
  return h("nav", { "aria-label": "Place", class: "trail" }, h("a", { href: "#/" }, "Experiments"), " / ", study);
}

function factsOf(experiment) {
  const { progress } = experiment;
  const failed = progress.failed ? `, ${count(progress.failed)} failed` : "";
  const saved = progress.rollouts_saved ? `, ${count(progress.rollouts_saved)} not needed` : "";
  const broken = progress.rollouts_failed ? `, physics failed in ${count(progress.rollouts_failed)}` : "";
  return [
    ["Done", percent(progress)],
    ["Repetitions", `${count(progress.completed)} of ${count(progress.repetitions)}${failed}`],
    ["Iterations", `${count(progress.iterations_done)} of ${count(progress.iterations)}`],
    ["Rollouts", `${count(progress.rollouts_done)} of ${count(progress.rollouts)}${saved}${broken}`],
    ...times(experiment),
    ["Priority", experiment.priority],
    ["At once", experiment.max_parallel === null ? "any number" : `at most ${count(experiment.max_parallel)}`],
  ].map(([name, value]) => h("div", {}, h("dt", {}, name), h("dd", {}, String(value))));
}

function times({ state, progress, created_at: created, started_at: started, ended_at: ended }) {
  if (ENDED.includes(state) && ended) {
    const took = started ? [["Took", duration((Date.parse(ended) - Date.parse(started)) / 1000)]] : [];
    return [["Ended", age(ended)], ...took];
  }
  const left = progress.seconds_left === null ? "not known yet" : duration(progress.seconds_left);
  return [["Time left", state === "RUNNING" ? left : "–"], started ? ["Began", age(started)] : ["Submitted", age(created)]];
}

function remarksOf({ warnings, reasons }) {
  const list = (words, each, kind) =>
    h("div", { class: `remark ${kind}` }, h("strong", {}, words), h("ul", {}, ...each.map((one) => h("li", {}, one))));
  return [
    ...(warnings.length ? [list("Warnings", warnings, "warned")] : []),
    ...(reasons.length ? [list("Why repetitions failed", reasons, "broken")] : []),
  ];
}

function links({ id, experiment }) {
  const toy = experiment.spec.robot?.name === "toy_function";
  return h("p", { class: "links" },
    h("a", { href: `#/compare?experiments=${id}` }, "Compare with others"), " ",
    toy ? h("a", { href: `#/toy?experiment=${id}` }, "Step through the function") : h("a", { href: `#/replay?experiment=${id}` }, "Replay a controller"), " ",
    download("Archive of everything (.zip)", `/experiments/${id}/export`, {}, `gaplab-${id}.zip`));
}
