// @ts-check
/**
 * Pauses, and whether the page is visible: a hidden tab holds no connection, since a browser opens only six to a service, for all its
 * tabs together.
 */

const HIDDEN_MS = 5000;  // a reader who only looks something up in another tab comes back to an open stream

/** Wait until the page is visible, or `signal` is aborted. @param {AbortSignal} signal @returns {Promise<void>} */
export function untilVisible(signal) {
  return new Promise((resume) => {
    const done = new AbortController();
    const check = () => {
      if (document.hidden && !signal.aborted) return;
      done.abort();
      resume();
    };
    document.addEventListener("visibilitychange", check, { signal: done.signal });
    signal.addEventListener("abort", check, { signal: done.signal });
    check();
  });
}

/**
 * Return a controller that is aborted with `signal`, or once the page has been hidden for some seconds. The caller aborts it after use.
 * @param {AbortSignal} signal
 */
export function abortWhenHidden(signal) {
  const controller = new AbortController();
  /** @type {number | undefined} */
  let timer;
  const check = () => {
    clearTimeout(timer);
    if (document.hidden) timer = setTimeout(() => controller.abort(), HIDDEN_MS);
  };
  document.addEventListener("visibilitychange", check, { signal: controller.signal });
  signal.addEventListener("abort", () => controller.abort(), { signal: controller.signal });
  controller.signal.addEventListener("abort", () => clearTimeout(timer));
  check();
  return controller;
}

/**
 * Resolve after some time, or as soon as `signal` is aborted. A signal that lives longer keeps nothing of a pause.
 * @param {number} ms
 * @param {AbortSignal} [signal]
 * @returns {Promise<void>}
 */
export const rest = (ms, signal = undefined) => new Promise((resume) => {
  const over = new AbortController();
  const timer = setTimeout(() => { over.abort(); resume(); }, ms);
  signal?.addEventListener("abort", () => { clearTimeout(timer); resume(); }, { once: true, signal: over.signal });
});

/** Return how long to wait before another try, in milliseconds: twice as long each time, up to half a minute. @param {number} failures in a row */
export const backoffMs = (failures) => (failures ? Math.min(30_000, 1000 * 2 ** (failures - 1)) : 0);
