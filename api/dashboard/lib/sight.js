/** Whether anybody sees the page: a tab that nobody sees holds no connection, for a browser opens six to a service, for all tabs together. */

const HIDDEN_MS = 5000;  // whoever only looks something up in another tab comes back to a stream that is still there

/** Resolves when the page is in sight, or `signal` is aborted. */
export function inSight(signal) {
  return new Promise((resume) => {
    const over = new AbortController();
    const look = () => {
      if (document.hidden && !signal.aborted) return;
      over.abort();
      resume();
    };
    document.addEventListener("visibilitychange", look, { signal: over.signal });
    signal.addEventListener("abort", look, { signal: over.signal });
    look();
  });
}

/** What is aborted with `signal`, and when the page has been out of sight for some seconds; whoever needs it no longer aborts it himself. */
export function whileInSight(signal) {
  const until = new AbortController();
  let timer = null;
  const look = () => {
    clearTimeout(timer);
    timer = document.hidden ? setTimeout(() => until.abort(), HIDDEN_MS) : null;
  };
  document.addEventListener("visibilitychange", look, { signal: until.signal });
  signal.addEventListener("abort", () => until.abort(), { signal: until.signal });
  until.signal.addEventListener("abort", () => clearTimeout(timer));
  look();
  return until;
}
