// @ts-check
/** The link to the bench in the bar: only where there is a robot on a bench. */

import { get } from "../api.js";
import { byId } from "../dom.js";

let isAsked = false;

/** Show the link to the bench. */
export function showBenchLink() {
  byId("to-bench").hidden = false;
}

/** Show the link to the bench if the service has ever asked for a measurement. */
export async function linkBench() {
  if (isAsked) return;
  isAsked = true;
  try {
    if ((await get("/requests", { limit: 1, pending: false })).items.length) showBenchLink();
  } catch {
    isAsked = false;  // asked again with the next view
  }
}
