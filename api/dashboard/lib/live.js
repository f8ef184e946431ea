// @ts-check
/** Keeps a view up to date: it is refreshed when something happened, and when the service is back. */

import { streamEvents } from "./api.js";
import { byId, h, setText } from "./dom.js";
import { age } from "./format.js";

const INTERVAL_MS = 1000;
const MOST_EVENTS = 1000;
const GONE = 404;
const RETIME_MS = 30_000;

/**
 * Call `refresh` soon after events that fit a query, at most once a second, with the events since the last call.
 *
 * No events are given after a break of the stream, or if there were too many to look at one by one: then everything may have
 * changed. Calls do not overlap; one that failed is repeated. A hidden page waits until it is visible. The bar at the top says
 * when the service is away. The page is loaded again when the token is no longer valid, or the database was replaced.
 * @param {Page.Query} query
 * @param {(events: Page.ServerEvent[]) => Promise<void>} refresh
 * @param {AbortSignal} signal
 */
export function follow(query, refresh, signal) {
  /** @type {Page.ServerEvent[]} */
  let events = [];
  let hasGap = false;  // until the next successful refresh: the events alone do not tell what is missing
  let isDue = false;
  let isBusy = false;
  let isAway = false;
  /** @type {number | null} */
  let timer = null;
  const run = async () => {
    timer = null;
    if (signal.aborted || isBusy || document.hidden) return;
    const taken = hasGap || events.length > MOST_EVENTS ? [] : events;
    events = [];
    hasGap = false;
    isBusy = true;
    isDue = false;
    try {
      await refresh(taken);
    } catch (error) {
      if (signal.aborted) return;
      if (error.status === GONE) {  // it was deleted: the page says so once it is loaded again
        location.reload();
        return;
      }
      console.warn(error.message);
      events = [...taken, ...events];
      hasGap ||= !taken.length;
      isDue = true;
    }
    isBusy = false;
    if (isDue) schedule();
  };
  const schedule = () => {
    isDue = true;
    timer ??= setTimeout(run, INTERVAL_MS);
  };
  const happened = (/** @type {Page.ServerEvent} */ event) => {
    if (events.length <= MOST_EVENTS) events.push(event);
    schedule();
  };
  const connected = (/** @type {boolean} */ isConnected, reason = "") => {
    if (signal.aborted) return;
    showConnection(isConnected, reason);
    if (isConnected && isAway) {
      hasGap = true;
      schedule();
    }
    isAway = !isConnected;
  };
  document.addEventListener("visibilitychange", () => { if (isDue) schedule(); }, { signal });
  signal.addEventListener("abort", () => {
    clearTimeout(timer ?? undefined);
    showConnection(true);
  });
  streamEvents(query, happened, connected, signal).catch(() => location.reload());
}

/**
 * Return functions that load a page again, and that take an answer to a change of it. Of two answers the one that was asked for later
 * stays, whichever comes first: an older one has an older state and an older tag.
 * @param {() => Promise<Page.Tagged<any>>} load
 * @param {(tagged: Page.Tagged<any>) => void} show
 * @returns {Pick<Page.StudyPage, "take" | "reload">}
 */
export function latestAnswers(load, show) {
  let asked = 0;
  let shown = 0;
  const showUnlessOlder = (/** @type {number} */ number, /** @type {Page.Tagged<any>} */ tagged) => {
    if (number < shown) return;
    shown = number;
    show(tagged);
  };
  return {
    take: (tagged) => showUnlessOlder(++asked, tagged),
    async reload() {
      const number = ++asked;
      showUnlessOlder(number, await load());
    },
  };
}

/**
 * Act at regular intervals until `signal`, while somebody sees the page.
 * @param {number} intervalMs
 * @param {() => void} act
 * @param {AbortSignal} signal
 */
export function every(intervalMs, act, signal) {
  const timer = setInterval(() => { if (!document.hidden) act(); }, intervalMs);
  signal.addEventListener("abort", () => clearInterval(timer));
}

/** Return how long ago a moment was. @param {string} time */
export const ageOf = (time) => h("time", { datetime: time, title: new Date(time).toLocaleString() }, age(time));

/** Bring the ages below an element up to date now and then, until `signal`. @param {HTMLElement} element @param {AbortSignal} signal */
export function keepAges(element, signal) {
  every(RETIME_MS, () => { for (const time of element.querySelectorAll("time")) time.textContent = age(time.dateTime); }, signal);
}

/** Say in the bar that the service is away, or why it refused the stream of events. @param {boolean} isConnected @param {string} [reason] */
function showConnection(isConnected, reason = "") {
  const problem = reason ? `Live updates are refused: ${reason.replace(/\.$/, "")}` : "The service is away";
  setText(byId("connection"), isConnected ? "" : `${problem}; trying again…`);
}
