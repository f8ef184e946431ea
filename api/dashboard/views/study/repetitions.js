// @ts-check
/** How an experiment is computed: its repetitions, with every attempt at one of them on demand, software and machines, and the resolved spec. */

import { get, post } from "../../lib/api.js";
import { copyButton } from "../../lib/copy.js";
import { openDialog } from "../../lib/dialog.js";
import { button, h } from "../../lib/dom.js";
import { REWRITES } from "../../lib/event_kinds.js";
import { age, count, timeBetween } from "../../lib/format.js";
import { stringify } from "../../lib/json.js";
import { empty } from "../../lib/placeholders.js";
import { stateBadge } from "../../lib/state_badge.js";
import { factItems, framed, table } from "../../lib/table.js";

const REPETITION_KINDS = ["transferred", "probed", "extended", "cancelled", "paused", "completed", ...REWRITES,
  ...["claimed", "completed", "failed", "lost", "handed_back", "waits", "paused", "stopped", "cancelled"].map((kind) => `repetition_${kind}`)];
const COLUMNS = ["Repetition", "State", "Iterations", "Rollouts", "Attempts", "Began", "Took", "Why it failed"];
const ATTEMPT_COLUMNS = ["Attempt", "Supervisor", "Began", "Took", "How it ended", "Reason"];

const PROVENANCE_KINDS = ["repetition_claimed", "versions_refused", "versions_accepted", "completed"];
const AT_FIRST = 50;
const NOTE = "The complete spec. Reality’s parameters are null until the experiment has ended.";

/** Return a table with a row for each repetition, only the first ones at first. @param {Page.StudyPage} page */
export function repetitions(page) {
  const path = `/experiments/${page.experiment.id}/repetitions`;
  const place = h("div");
  const attempts = h("div", { role: "status" });
  const showAttempts = async (/** @type {number} */ number) => {
    const loaded = await get(`${path}/${number}/attempts`, {}, page.signal);
    attempts.replaceChildren(h("h3", {}, `Attempts at repetition ${number}`), attemptsTable(number, loaded));
    attempts.scrollIntoView({ block: "nearest" });
  };
  let shown = AT_FIRST;
  const load = async () => {
    /** @type {Api.RepetitionRead[]} */
    const loaded = await get(path, {}, page.signal);
    const focused = place.contains(document.activeElement) ? /** @type {HTMLElement} */ (document.activeElement).dataset.repetition : null;
    place.replaceChildren(table("Repetitions", COLUMNS, loaded.slice(0, shown).map((repetition) => row(repetition, page.experiment, showAttempts))));
    more.hidden = loaded.length <= shown;
    more.textContent = `Show more of ${count(loaded.length)}`;
    if (focused) /** @type {HTMLElement | null} */ (place.querySelector(`[data-repetition="${focused}"]`))?.focus();
  };
  const more = button("", () => {
    shown *= 4;
    load().catch(() => {});
  }, { hidden: true });
  page.sections.add(place, REPETITION_KINDS, load);
  return [place, h("p", { class: "pages" }, more), attempts];
}

/** @param {Api.RepetitionRead} repetition @param {Api.ExperimentRead} experiment @param {(number: number) => Promise<void>} showAttempts */
function row({ number, state, attempts, started_at: started, ended_at: ended, ...others }, { level, spec }, showAttempts) {
  const done = Math.max(0, others.iterations_done - 1);  // number 0 is not counted
  const caveat = state === "COMPLETED" && !level && done < spec.iterations ? "stopped early" : null;
  const link = h("button", {
    type: "button", class: "link", dataset: { repetition: number }, "aria-label": `Attempts at repetition ${number}: ${attempts}`,
    onclick: () => showAttempts(number).catch(() => {}),
  }, attempts);
  return [number, stateBadge(state, caveat), level ? "–" : `${count(done)} of ${count(spec.iterations)}`, count(others.rollouts_done),
    attempts ? link : "0", started ? age(started) : "–", timeBetween(started, ended), others.error];
}

/** @param {number} repetition @param {Api.AttemptRead[]} attempts */
function attemptsTable(repetition, attempts) {
  const rows = attempts.map(({ number, owner, started_at: started, ended_at: ended, ending, reason }) =>
    [number, owner, age(started), timeBetween(started, ended), ending ?? "still running", reason]);
  return table(`Attempts at repetition ${repetition}`, ATTEMPT_COLUMNS, rows);
}

/** Return a list of every software and machine that computed a part of the experiment. @param {Page.StudyPage} page */
export function provenance(page) {
  const place = h("div");
  page.sections.add(place, PROVENANCE_KINDS, async () => {
    /** @type {Api.ProvenanceRead} */
    const { computed_with: versions, refused_by: others, uses } = await get(`/experiments/${page.experiment.id}/provenance`, {}, page.signal);
    place.replaceChildren(...(others ? [refusedBlock(page, versions, others)] : []),
      ...(uses.length ? uses.map(useBlock) : [empty("No supervisor of this service has computed any part of it.")]));
  });
  return [place];
}

/** @param {Page.StudyPage} page @param {string | null} versions @param {string} others */
function refusedBlock(page, versions, others) {
  const accept = async () => {
    await post(`/studies/${page.id}/accept-versions`);
    await page.reload();
  };
  const ask = () => openDialog({
    title: "Continue under other versions?",
    text: "Its numbers may then differ from those of the first versions. The provenance records which versions were used.",
    action: "Continue", danger: true, act: accept,
  }, page.signal);
  const text = `It was begun with ${versions}. A supervisor with ${others} does not continue it.`;
  return h("div", { class: "remark warned" }, h("p", {}, text), h("button", { type: "button", class: "quiet", onclick: ask }, "Let it continue…"));
}

/** @param {Api.ProvenanceUse} use */
function useBlock({ since, repetitions, provenance: used }) {
  const versions = Object.entries({ ...used.engines, ...used.libraries }).map(([name, version]) => `${name} ${version.replace(`${name} `, "")}`);
  const commit = used.commit ? `${used.commit.slice(0, 12)}${used.dirty ? ", with changes" : ""}` : "not known";
  const facts = factItems([
    ["Since", new Date(since).toLocaleString()], ["Repetitions", repetitions], ["gaplab", `${used.gaplab} (code ${used.code})`],
    ["Commit", commit], ["Python", used.python], ["Libraries", versions.join(", ")],
    ["Machine", `${used.processor}, ${used.architecture}`], ["System", used.system], ["Version of the spec", used.spec_version],
  ]);
  return framed("Provenance", h("dl", { class: "facts stacked" }, ...facts));
}

/** Return the spec as JSON, with a button that copies it. @param {Page.StudyPage} page */
export function spec(page) {
  const text = () => stringify(page.experiment.spec, 2);
  const code = h("code");
  const place = framed("Spec as JSON", h("pre", {}, code));
  page.sections.add(place, ["extended", "completed", "failed", "cancelled"], async () => {
    await page.reload();
    code.textContent = text();
  });
  return [h("p", {}, copyButton("Copy the spec", text)), h("p", { class: "note" }, NOTE), place];
}
