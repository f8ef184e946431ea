// @ts-check
/** Pauses. */

/**
 * Resolve after some time, or as soon as `signal` is aborted.
 *
 * @param {number} ms
 * @param {AbortSignal} [signal]
 * @returns {Promise<void>}
 */
export const rest = (ms, signal = undefined) => new Promise((resume) => {
  const timer = setTimeout(resume, ms);
  signal?.addEventListener("abort", () => { clearTimeout(timer); resume(); }, { once: true });
});
