/** The head of a study: its name and notes, how far it is, and what may be asked of it. */

import { h, refill } from "../../lib/dom.js";
import { download } from "../../lib/downloads.js";
import { edit } from "../../lib/editing.js";
import { age, count, duration, fixed, spoken } from "../../lib/format.js";
import { pill } from "../../lib/pill.js";
import { progressBar } from "../../lib/progress.js";
import { say } from "../../lib/rows.js";
import { verbs } from "./verbs.js";

/** The head's element, and `update()` for when `page.study` is another. */
export function head(page) {
  const title = h("h1");
  const state = h("span", { class: "state-now", role: "status" });
  const notes = h("p", { class: "notes" });
  const bar = progressBar("Progress");
  const facts = h("dl", { class: "facts" });
  const remarks = h("div", { class: "remarks" });
  const asked = verbs(page);
  const update = () => {
    const { study } = page;
    say(title, study.name);
    document.title = `${study.name} · gaplab`;
    say(notes, study.notes ?? "");
    notes.hidden = !study.notes;
    refill(state, study.state, () => pill(study.state));
    bar.update(study.progress);
    const known = factsOf(page);
    refill(facts, JSON.stringify(known), () => known.map(([name, value]) => h("div", {}, h("dt", {}, name), h("dd", {}, value))));
    const found = remarksOf(study);
    refill(remarks, JSON.stringify(found), () => found.map(remark));
    asked.update();
  };
  const change = () => edit(page, `/studies/${page.id}`, () => page.study);
  const pen = h("button", { type: "button", class: "quiet small", onclick: change }, "Edit name and notes");
  update();
  const trail = h("nav", { "aria-label": "Place", class: "trail" }, h("a", { href: "#/" }, "Studies"));
  const element = h("header", { class: "experiment-head" }, trail, h("div", { class: "titled" }, title, state, pen),
    notes, h("div", { class: "whole" }, bar.element), facts, remarks, asked.element, links(page));
  return { element, update };
}

function factsOf({ study, unit }) {
  const { progress, experiments } = study;
  const best = experiments.filter((each) => each.best_fitness !== null).sort((a, b) => b.best_fitness - a.best_fitness)[0];
  const ended = experiments.filter((each) => each.ended_at).length;
  const failed = progress.failed ? `, ${count(progress.failed)} failed` : "";
  return [
    ["Experiments", `${count(ended)} of ${count(experiments.length)} ended`],
    ["Repetitions", `${count(progress.completed)} of ${count(progress.repetitions)}${failed}`],
    ["Rollouts", `${count(progress.rollouts_done)}, ${count(progress.rollouts_saved)} saved, of ${count(progress.rollouts)}`],
    ...(best ? [["Best fitness", `${fixed(best.best_fitness)} ${unit(best)} by ${spoken(best.name)}`]] : []),
    ...times(study),
  ];
}

function times({ state, progress, experiments, created_at: created }) {
  const ends = experiments.map((each) => each.ended_at);
  if (ends.every(Boolean)) return [["Ended", age(ends.sort().at(-1))]];
  const left = progress.seconds_left === null ? "not known yet" : duration(progress.seconds_left);
  return [["Time left", state === "RUNNING" ? left : "–"], ["Submitted", age(created)]];
}

/** Warnings and failures, each once, with the experiments that have them. */
function remarksOf({ experiments }) {
  const gather = (of) => {
    const found = new Map();
    for (const each of experiments) for (const words of of(each)) found.set(words, [...(found.get(words) ?? []), each.name]);
    return [...found].map(([words, names]) => [words, names.length === experiments.length ? "" : names.join(", ")]);
  };
  const kinds = [["Warnings", "warned", gather((each) => each.warnings)], ["Why repetitions failed", "broken", gather((each) => each.reasons)]];
  return kinds.filter(([, , list]) => list.length);
}

function remark([title, kind, list]) {
  const items = list.map(([words, names]) => h("li", {}, words, names ? h("span", { class: "note" }, ` (${names})`) : null));
  return h("div", { class: `remark ${kind}` }, h("strong", {}, title), h("ul", {}, ...items));
}

function links({ id, study }) {
  const ids = study.experiments.map((each) => each.id).join(",");
  return h("p", { class: "links" }, h("a", { href: `#/compare?experiments=${ids}` }, "Compare its experiments"),
    download("Archive of everything (.zip)", `/studies/${id}/export`, {}, `gaplab-${id}.zip`));
}
