// @ts-check
/** Pauses. */

/**
 * Resolve after some time, or as soon as `signal` is aborted. A signal that lives longer keeps nothing of a pause.
 *
 * @param {number} ms
 * @param {AbortSignal} [signal]
 * @returns {Promise<void>}
 */
export const rest = (ms, signal = undefined) => new Promise((resume) => {
  const over = new AbortController();
  const timer = setTimeout(() => { over.abort(); resume(); }, ms);
  signal?.addEventListener("abort", () => { clearTimeout(timer); resume(); }, { once: true, signal: over.signal });
});
