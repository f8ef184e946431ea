/** The repetitions, and on demand every attempt at one of them. */

import { get } from "../../lib/api.js";
import { h } from "../../lib/dom.js";
import { age, count, duration } from "../../lib/format.js";
import { pill } from "../../lib/pill.js";
import { table } from "../../lib/table.js";

const KINDS = ["transferred", "probed", "extended", "cancelled", "paused", "completed",
  ...["claimed", "completed", "failed", "lost", "handed_back", "paused", "stopped", "cancelled"].map((each) => `repetition_${each}`)];

const MANY = 50;

/** A line for each repetition, the first of them at first. */
export function repetitions(page) {
  const place = h("div");
  const attempts = h("div", { role: "status" });
  const show = async (number) => {
    const found = await get(`/experiments/${page.id}/repetitions/${number}/attempts`, {}, page.signal);
    attempts.replaceChildren(h("h3", {}, `Attempts at repetition ${number}`), attemptsTable(number, found));
    attempts.scrollIntoView({ block: "nearest" });
  };
  let shown = MANY;
  const load = async () => {
    const found = await get(`/experiments/${page.id}/repetitions`, {}, page.signal);
    const focused = place.contains(document.activeElement) ? document.activeElement.dataset.repetition : null;
    const columns = ["Repetition", "State", "Iterations", "Rollouts", "Attempts", "Began", "Took", "Why it failed"];
    place.replaceChildren(table("Repetitions", columns, found.slice(0, shown).map((each) => row(each, show))));
    more.hidden = found.length <= shown;
    more.textContent = `Show more of ${count(found.length)}`;
    if (focused) place.querySelector(`[data-repetition="${focused}"]`)?.focus();
  };
  const more = h("button", { type: "button", class: "quiet small", hidden: true, onclick: () => {
    shown *= 4;
    load().catch(() => {});
  } });
  page.parts.add(place, KINDS, load);
  return [place, h("p", { class: "pages" }, more), attempts];
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
