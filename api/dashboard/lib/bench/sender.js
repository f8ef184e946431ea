// @ts-check
/** The bench in the bar, whatever view is open: its link, and how many answers wait in this browser, which are sent. */

import { get, post } from "../api.js";
import { byId, h, refill } from "../dom.js";
import { backoffMs } from "../waiting.js";
import { outbox } from "./outbox.js";

const PATIENCE_MS = 20_000;  // a wireless that is gone says nothing
const CHANGED = "gaplab-answers";

let failures = 0;
let isAsked = false;
/** @type {number | undefined} */
let timer;

/** The answers of this browser. */
export const answers = outbox(
  ({ request, body, key }) => post(`/requests/${request}/measurements`, body, { "Idempotency-Key": key }, AbortSignal.timeout(PATIENCE_MS)),
  () => { dispatchEvent(new Event(CHANGED)); },
);

const waiting = () => answers.list().filter(({ state }) => state === "waiting");

/** Call a handler after every change of the answers, also in another tab, until `signal`. @param {() => void} handler @param {AbortSignal} signal */
export function onAnswers(handler, signal) {
  addEventListener(CHANGED, handler, { signal });
}

/** Send what waits now; what could not be sent is tried again later. */
export async function sendWaiting() {
  clearTimeout(timer);
  if (!waiting().length) return;
  failures = (await answers.flush()) ? 0 : failures + 1;
  clearTimeout(timer);
  if (waiting().length) timer = setTimeout(sendWaiting, backoffMs(failures));
}

/** Send what an earlier visit left, and go on sending while the page is open. */
export function keepSending() {
  addEventListener(CHANGED, showWaiting);
  addEventListener("storage", changedElsewhere);
  addEventListener("online", sendWaiting);
  document.addEventListener("visibilitychange", () => { if (!document.hidden) sendWaiting(); });
  showWaiting();
  sendWaiting();
}

/** Leave an answer of another tab to it for a while, and then help. */
function changedElsewhere() {
  dispatchEvent(new Event(CHANGED));
  clearTimeout(timer);
  if (waiting().length) timer = setTimeout(sendWaiting, PATIENCE_MS);
}

function showWaiting() {
  const count = waiting().length;
  refill(byId("unsent"), String(count), () =>
    (count ? h("a", { href: "#/bench" }, `${count === 1 ? "1 answer waits" : `${count} answers wait`} to be sent`) : null));
}

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
