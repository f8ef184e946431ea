// @ts-check
/** Asks again and again, less often while the service does not answer, and not at all while the page is hidden. */

import { unreachable } from "../../lib/api.js";
import { abortWhenHidden, backoffMs, rest, untilVisible } from "../../lib/waiting.js";

const WAIT_S = 25;
const PATIENCE_MS = 15_000;
const PAUSE_MS = 4000;
const LEAST_MS = 1000;  // also where the service answers at once that nothing will follow

/**
 * Call `ask` until `signal`, or until `isOver` says that an error ends it.
 * @param {(waitS: number, signal: AbortSignal) => Promise<number>} ask returns the number of requests; with none, the service may wait
 * @param {(error: any) => void} told learns of each failure, and with null of each success
 * @param {AbortSignal} signal
 * @param {(error: any) => boolean} isOver
 */
export function keepPolling(ask, told, signal, isOver) {
  /** @type {(() => void) | null} */
  let wake = null;
  const now = () => wake?.();
  addEventListener("online", now, { signal });
  document.addEventListener("visibilitychange", () => { if (!document.hidden) now(); }, { signal });
  signal.addEventListener("abort", now);
  run();
  return { now };

  async function run() {
    let [failures, waitS] = [0, 0];
    while (!signal.aborted) {
      await untilVisible(signal);
      if (signal.aborted) return;
      const asking = abortWhenHidden(signal);
      const resting = new AbortController();
      let isWoken = false;
      wake = () => {
        isWoken = true;
        asking.abort();
        resting.abort();
      };
      const timer = setTimeout(() => asking.abort(unreachable()), 1000 * waitS + PATIENCE_MS);
      const start = performance.now();
      let pauseMs = 0;
      try {
        const count = await ask(waitS, asking.signal);
        failures = 0;
        told(null);
        pauseMs = count ? PAUSE_MS : Math.max(0, LEAST_MS - (performance.now() - start));
        waitS = count ? 0 : WAIT_S;
      } catch (error) {
        if (signal.aborted || isOver(error)) return;
        waitS = 0;
        if (!isWoken && error.name !== "AbortError") {  // neither woken nor hidden
          failures += 1;
          told(error);
          pauseMs = backoffMs(failures);
        }
      }
      clearTimeout(timer);
      asking.abort();
      if (isWoken) waitS = 0;
      else await rest(pauseMs, resting.signal);
    }
  }
}
