// @ts-check
/** What the service refuses until it is confirmed: a high cost, or a name that is nearly that of another bench. */

import { openDialog } from "./dialog.js";

/**
 * Send a request; if the service wants it confirmed, ask the reader, and send it again.
 *
 * @template T
 * @param {(query: string) => Promise<T>} send adds a query to the address
 * @param {AbortSignal} signal
 * @returns {Promise<T | null>} the answer; null if the reader went back
 */
export async function confirmingCost(send, signal) {
  try {
    return await send("");
  } catch (error) {
    const refused = /** @type {Api.SpecError[]} */ (error.errors ?? []).find(({ pointer }) => pointer === "confirm_cost");
    if (!refused) throw error;
    return new Promise((resolve) => {
      const dialog = openDialog({
        title: "Is that right?", text: `The service says: ${refused.message}.`, action: "Do it all the same",
        act: async () => { resolve(await send("?confirm_cost=true")); },
      }, signal);
      dialog.addEventListener("close", () => { resolve(null); });  // after an answer, this does nothing
    });
  }
}
