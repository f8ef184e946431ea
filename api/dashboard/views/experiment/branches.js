// @ts-check
/** Closed branches: steps that a correction or a void took out of the log. They count nowhere, and stay readable. */

import { get } from "../../lib/api.js";
import { h, refill } from "../../lib/dom.js";
import { count } from "../../lib/format.js";
import { empty } from "../../lib/placeholders.js";
import { framed } from "../../lib/table.js";
import { eventText, REWRITES } from "./event_words.js";

/**
 * Return the branches, each with its steps on demand.
 *
 * @param {Page.ExperimentPage} page
 */
export function branches(page) {
  const place = h("div");
  page.sections.add(place, REWRITES, async () => {
    /** @type {Api.BranchRead[]} */
    const loaded = await get(`/experiments/${page.id}/branches`, {}, page.signal);
    refill(place, JSON.stringify(loaded.map(({ repetition, number }) => [repetition, number])), () =>
      (loaded.length ? loaded.map(branch) : empty("No correction has closed a branch.")));
  });
  return [h("p", { class: "note" }, "Steps that followed from a measurement which was corrected or voided. They are in no curve; measurements among them are reused."), place];
}

/** @param {Api.BranchRead} branch */
function branch({ repetition, number, iteration, reason, steps, closed_at: at }) {
  const title = `Branch ${number} of repetition ${repetition}, from iteration ${iteration}: ${count(steps.length)} ${steps.length === 1 ? "step" : "steps"}`;
  return h("details", { class: "branch" },
    h("summary", {}, title, h("span", { class: "note" }, ` ${reason} · closed ${new Date(at).toLocaleString()}`)),
    framed(title, h("ol", { class: "events" }, ...steps.map((step) => h("li", {}, stepText(step, repetition))))));
}

/**
 * Return a step in the words of its event.
 *
 * @param {Record<string, any>} step
 * @param {number} repetition
 */
export function stepText({ kind, simulators, ...body }, repetition) {
  const error = simulators?.[0]?.squared_error;
  const values = body.repeats?.length ? ` (${body.repeats.join(", ")})` : "";
  const told = { kind, repetition, body: { ...body, ...(error === undefined ? {} : { squared_error: error }) } };
  return `${eventText(/** @type {Api.EventRead} */ (told))}${values}`;
}
