// @ts-check
/** The line in the bar about the health of the service: why experiments do not run although the page is served. */

import { get } from "./api.js";
import { byId, setText } from "./dom.js";

const INTERVAL_MS = 10_000;

/**
 * Return what is wrong with the service, in words; nothing if all is well, or if the service does not answer, which the view tells.
 * @param {() => Promise<{ warnings?: string[] }>} ask
 */
export async function trouble(ask) {
  try {
    return ((await ask()).warnings ?? []).join("; ");
  } catch (error) {
    return error.status === 503 ? error.message : "";
  }
}

/** Show the health of the service now, and again at regular intervals while the page is visible. */
export async function watchHealth() {
  if (!document.hidden) setText(byId("health"), await trouble(() => get("/readyz")));
  setTimeout(watchHealth, INTERVAL_MS);
}
