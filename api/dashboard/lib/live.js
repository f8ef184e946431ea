/** What a view shows is kept up to date: it is asked for anew when something happened, and when the service is back. */

import { events } from "./api.js";

const EVERY_MS = 1000;

/**
 * Call `refresh(some)` soon after events that fit `query`, at most once a second however many come, with all that came
 * since the last call; and once after a break, with none. It is not called again before it has ended. What it throws is ignored:
 * the next event, or the service's return, calls it again. The bar says when the service is away.
 */
export function follow(query, refresh, signal) {
  let some = [];
  let timer = null;
  let busy = false;
  let away = false;
  const run = async () => {
    timer = null;
    if (signal.aborted || busy) return;
    busy = true;
    const taken = some;
    some = [];
    try {
      await refresh(taken);
    } catch (error) {
      if (!signal.aborted) console.warn(error.message);
    }
    busy = false;
    if (some.length) soon();
  };
  const soon = () => {
    timer ??= setTimeout(run, EVERY_MS);
  };
  const connected = (is) => {
    if (signal.aborted) return;
    announce(is);
    if (is && away) run();
    away = !is;
  };
  signal.addEventListener("abort", () => {
    clearTimeout(timer);
    announce(true);
  });
  events(query, (event) => { some.push(event); soon(); }, connected, signal).catch(() => {});
}

/** Say in the bar whether the service is there. */
export function announce(isThere) {
  const place = document.getElementById("connection");
  const words = isThere ? "" : "The service is away; trying again…";
  if (place.textContent !== words) place.textContent = words;
}
