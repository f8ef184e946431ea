// @ts-check
/** The other requests that wait. */

import { ageOf } from "../../lib/ages.js";
import { requestWords } from "../../lib/bench/values.js";
import { h } from "../../lib/dom.js";
import { readableName } from "../../lib/format.js";

/**
 * Return the list; nothing if there are none.
 *
 * @param {Api.RequestRead[]} requests
 * @param {Page.BenchView} view
 */
export function otherList(requests, view) {
  if (!requests.length) return null;
  return h("section", { class: "card others", "aria-labelledby": "others-title" }, h("h2", { id: "others-title" }, "Others that wait"),
    h("ul", { class: "rows" }, ...requests.map((request) => row(request, view))));
}

/**
 * @param {Api.RequestRead} request
 * @param {Page.BenchView} view
 */
function row(request, view) {
  const { id, robot, bench, experiment, experiment_name: name } = request;
  const words = `${readableName(robot)}${bench === robot ? "" : ` (${bench})`}, ${requestWords(request)}`;
  return h("li", { class: request.state }, h("strong", {}, words), h("span", { class: "note" }, h("a", { href: `#/experiments/${experiment}` }, name), " · asked ", ageOf(request.created_at)),
    h("span", {}, stateText(request), " ", h("button", { type: "button", class: "quiet small", "aria-label": `Show ${words}`, onclick: () => view.choose(id) }, "Show")));
}

/**
 * Return the state of a request in words.
 *
 * @param {Pick<Api.RequestRead, "state" | "taken_by" | "unanswered" | "busy">} request
 */
export function stateText({ state, taken_by: by, unanswered, busy }) {
  if (state === "taken") return `▶ taken by ${by}`;
  if (state === "stuck") return `✕ stuck: taken ${unanswered} times without an answer`;
  return busy ? "○ open, its bench is busy" : "○ open";
}
