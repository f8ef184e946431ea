/** The repetitions, and on demand every attempt at one of them. */

import { get } from "../../lib/api.js";
import { h } from "../../lib/dom.js";
import { age, count, duration } from "../../lib/format.js";
import { pill } from "../../lib/pill.js";
import { table } from "../../lib/table.js";

const KINDS = ["transferred", "probed", "extended", "cancelled", "paused", "completed",
  ...["claimed", "completed", "failed", "lost", "handed_back", "paused", "stopped", "cancelled"].map((each) => `repetition_${each}`)];

/** A line for each repetition. */
export function repetitions(page) {
  const place = h("div");
  const attempts = h("div", { role: "status" });
  const show = async (number) => {
    const found = await get(`/experiments/${page.id}/repetitions/${number}/attempts`, {}, page.signal);
    attempts.replaceChildren(h("h3", {}, `Attempts at repetition ${number}`), attemptsTable(number, found));
    attempts.scrollIntoView({ block: "nearest" });
  };
  page.parts.add(place, KINDS, async () => {
    const found = await get(`/experiments/${page.id}/repetitions`, {}, page.signal);
    const focused = place.contains(document.activeElement) ? document.activeElement.dataset.repetition : null;
    const columns = ["Repetition", "State", "Iterations", "Rollouts", "Attempts", "Began", "Took", "Why it failed"];
    place.replaceChildren(table("Repetitions", columns, found.map((each) => row(each, show))));
    if (focused) place.querySelector(`[data-repetition="${focused}"]`)?.focus();
  });
  return [place, attempts];
}

function row(each, show) {
  const button = h("button", {
    type: "button", class: "link", dataset: { repetition: each.number }, "aria-label": `Attempts at repetition ${each.number}: ${each.attempts}`,
    onclick: () => show(each.number).catch(() => {}),
  }, String(each.attempts));
  return [String(each.number), pill(each.state), count(each.iterations_done), count(each.rollouts_done),
    each.attempts ? button : "0", each.started_at ? age(each.started_at) : "–", took(each), each.error ?? ""];
}

function attemptsTable(number, found) {
  const columns = ["Attempt", "Supervisor", "Began", "Took", "How it ended", "Reason"];
  return table(`Attempts at repetition ${number}`, columns, found.map((each) =>
    [String(each.number), each.owner, age(each.started_at), took(each), each.ending ?? "goes on", each.reason ?? ""]));
}

function took({ started_at: began, ended_at: ended }) {
  return began && ended ? duration((Date.parse(ended) - Date.parse(began)) / 1000) : "–";
}
