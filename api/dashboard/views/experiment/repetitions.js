// @ts-check
/** The repetitions of an experiment, and every attempt at one of them on demand. */

import { get } from "../../lib/api.js";
import { h } from "../../lib/dom.js";
import { age, count, timeBetween } from "../../lib/format.js";
import { stateBadge } from "../../lib/state_badge.js";
import { table } from "../../lib/table.js";
import { REWRITES } from "./event_words.js";

const KINDS = ["transferred", "probed", "extended", "cancelled", "paused", "completed", ...REWRITES,
  ...["claimed", "completed", "failed", "lost", "handed_back", "waits", "paused", "stopped", "cancelled"].map((kind) => `repetition_${kind}`)];
const COLUMNS = ["Repetition", "State", "Iterations", "Rollouts", "Attempts", "Began", "Took", "Why it failed"];
const ATTEMPT_COLUMNS = ["Attempt", "Supervisor", "Began", "Took", "How it ended", "Reason"];

const AT_FIRST = 50;

/**
 * Return a table with a row for each repetition, only the first ones at first.
 *
 * @param {Page.ExperimentPage} page
 */
export function repetitions(page) {
  const place = h("div");
  const attempts = h("div", { role: "status" });
  const showAttempts = async (/** @type {number} */ number) => {
    const loaded = await get(`/experiments/${page.id}/repetitions/${number}/attempts`, {}, page.signal);
    attempts.replaceChildren(h("h3", {}, `Attempts at repetition ${number}`), attemptsTable(number, loaded));
    attempts.scrollIntoView({ block: "nearest" });
  };
  let shown = AT_FIRST;
  const load = async () => {
    /** @type {Api.RepetitionRead[]} */
    const loaded = await get(`/experiments/${page.id}/repetitions`, {}, page.signal);
    const focused = place.contains(document.activeElement) ? /** @type {HTMLElement} */ (document.activeElement).dataset.repetition : null;
    place.replaceChildren(table("Repetitions", COLUMNS, loaded.slice(0, shown).map((repetition) => row(repetition, page.experiment, showAttempts))));
    more.hidden = loaded.length <= shown;
    more.textContent = `Show more of ${count(loaded.length)}`;
    if (focused) /** @type {HTMLElement | null} */ (place.querySelector(`[data-repetition="${focused}"]`))?.focus();
  };
  const more = h("button", { type: "button", class: "quiet small", hidden: true, onclick: () => {
    shown *= 4;
    load().catch(() => {});
  } });
  page.sections.add(place, KINDS, load);
  return [place, h("p", { class: "pages" }, more), attempts];
}

/**
 * @param {Api.RepetitionRead} repetition
 * @param {Api.ExperimentRead} experiment
 * @param {(number: number) => Promise<void>} showAttempts
 */
function row({ number, state, attempts, started_at: started, ended_at: ended, ...others }, { level, spec }, showAttempts) {
  const done = Math.max(0, others.iterations_done - 1);  // number 0 is not counted
  const caveat = state === "COMPLETED" && !level && done < spec.iterations ? "stopped early" : null;
  const button = h("button", {
    type: "button", class: "link", dataset: { repetition: number }, "aria-label": `Attempts at repetition ${number}: ${attempts}`,
    onclick: () => showAttempts(number).catch(() => {}),
  }, attempts);
  return [number, stateBadge(state, caveat), level ? "–" : `${count(done)} of ${count(spec.iterations)}`, count(others.rollouts_done),
    attempts ? button : "0", started ? age(started) : "–", timeBetween(started, ended), others.error];
}

/**
 * @param {number} repetition
 * @param {Api.AttemptRead[]} attempts
 */
function attemptsTable(repetition, attempts) {
  const rows = attempts.map(({ number, owner, started_at: started, ended_at: ended, ending, reason }) =>
    [number, owner, age(started), timeBetween(started, ended), ending ?? "still running", reason]);
  return table(`Attempts at repetition ${repetition}`, ATTEMPT_COLUMNS, rows);
}
