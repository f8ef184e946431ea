/** What a view shows is kept up to date: it is asked for anew when something happened, and when the service is back. */

import { events } from "./api.js";

const EVERY_MS = 1000;
const MANY = 1000;

/**
 * Call `refresh(some)` soon after events that fit `query`, at most once a second however many come, with all that came
 * since the last call; with none after a break, or after more than anybody wants to look at one by one. It is not called
 * again before it has ended, and again if it failed. A page that nobody sees waits until somebody does. The bar says when
 * the service is away.
 */
export function follow(query, refresh, signal) {
  let some = [];
  let all = false;  // whatever happens until it was asked for anew: what is missing is not told by events alone
  let due = false;
  let timer = null;
  let busy = false;
  let away = false;
  const run = async () => {
    timer = null;
    if (signal.aborted || busy || document.hidden) return;
    const taken = all || some.length > MANY ? [] : some;
    some = [];
    all = false;
    busy = true;
    due = false;
    try {
      await refresh(taken);
    } catch (error) {
      if (signal.aborted) return;
      console.warn(error.message);
      some = [...taken, ...some];
      all ||= !taken.length;
      due = true;
    }
    busy = false;
    if (due) soon();
  };
  const soon = () => {
    due = true;
    timer ??= setTimeout(run, EVERY_MS);
  };
  const happened = (event) => {
    if (some.length <= MANY) some.push(event);
    soon();
  };
  const connected = (is, why = "") => {
    if (signal.aborted) return;
    announce(is, why);
    if (is && away) {
      all = true;
      soon();
    }
    away = !is;
  };
  document.addEventListener("visibilitychange", () => { if (due) soon(); }, { signal });
  signal.addEventListener("abort", () => {
    clearTimeout(timer);
    announce(true);
  });
  events(query, happened, connected, signal).catch(() => {});
}

/** Say in the bar whether the service is there, or why what happens is not told. */
export function announce(isThere, why = "") {
  const place = document.getElementById("connection");
  const words = isThere ? "" : `${why ? `What happens is not seen here: ${why.replace(/\.$/, "")}` : "The service is away"}; trying again…`;
  if (place.textContent !== words) place.textContent = words;
}
