// @ts-check
/** What an experiment waits for: measurements of a robot on a bench. */

import { get } from "../../lib/api.js";
import { requestWords } from "../../lib/bench/values.js";
import { h } from "../../lib/dom.js";
import { count } from "../../lib/format.js";
import { stateText } from "../bench/others.js";
import { BENCH_KINDS } from "./measurements.js";

const MOST = 100;

/**
 * Return a remark with the measurements that are wanted now; nothing while there are none.
 *
 * @param {Page.ExperimentPage} page
 */
export function waitingRemark(page) {
  const place = h("div", { class: "remarks", role: "status" }, "");  // with a text, sections add no note that it loads
  page.sections.add(place, [...BENCH_KINDS, "waiting", "resumed", "paused"], async () => {
    /** @type {{ items: Api.RequestRead[], next: string | null }} */
    const { items, next } = await get("/requests", { experiment: page.id, limit: MOST }, page.signal);
    place.replaceChildren(...(items.length ? [remark(page.id, items, next !== null)] : []));
  });
  return place;
}

/**
 * @param {string} id
 * @param {Api.RequestRead[]} requests
 * @param {boolean} isMore
 */
function remark(id, requests, isMore) {
  return h("div", { class: "remark" }, h("p", {}, `${waitingText(requests, isMore)} `), h("a", { class: "button", href: `#/bench?experiment=${id}` }, "To the bench"));
}

/**
 * Return in a sentence what is waited for.
 *
 * @param {Pick<Api.RequestRead, "bench" | "repetition" | "iteration" | "kind" | "state" | "taken_by" | "unanswered" | "busy">[]} requests
 * @param {boolean} isMore whether there are more than these
 */
export function waitingText(requests, isMore = false) {
  const [first] = requests;
  const others = requests.length - 1;
  const rest = others ? `, and for ${isMore ? "more than " : ""}${count(others)} ${others === 1 ? "other" : "others"}` : "";
  return `It waits for a measurement on the bench “${first.bench}”: ${requestWords(first)} (${stateText(first).replace(/^\S+ /, "")})${rest}.`;
}
