// @ts-check
/** The take of this browser: others see who has the robot, and it is kept by heartbeats. */

import { newKey, post } from "../../lib/api.js";
import { browserStore } from "../../lib/bench/outbox.js";
import { isMine } from "../../lib/bench/requests.js";

const LEASE_S = 1800;  // a phone in a pocket shows no sign of life
const HEARTBEAT_MS = 300_000;
const GONE = [404, 409];

/** @typedef {import("../../lib/bench/requests.js").Holding} Holding */

/** A take that outlives a reload; one whose answer was lost is asked for again under its key. */
export class Take {
  /** @param {AbortSignal} signal @param {() => void} changed */
  constructor(signal, changed) {
    this.store = browserStore("take");
    this.changed = changed;
    const beat = () => { if (!document.hidden) this.beat(); };
    const timer = setInterval(beat, HEARTBEAT_MS);
    document.addEventListener("visibilitychange", beat, { signal });
    signal.addEventListener("abort", () => clearInterval(timer));
  }

  /** Return what this browser holds; null if nothing. */
  get holding() {
    return /** @type {Holding | null} */ (this.store.read("held"));
  }

  /** Take a request. @param {string} request id @param {string} operator */
  async take(request, operator) {
    const asked = this.store.read("asked");
    const isSame = asked?.request === request && asked.operator === operator;
    if (!isSame) this.store.write("asked", { request, operator, key: newKey() });
    await this.send();
  }

  /** Send the take that was asked for; it ends with an answer of the service. */
  async send() {
    const { request, operator, key } = this.store.read("asked");
    try {
      const taken = await post(`/requests/${request}/take`, { operator, lease_s: LEASE_S }, { "Idempotency-Key": key });
      this.store.remove("asked");
      this.store.write("held", { request, take: taken.takes, operator });
    } catch (error) {
      if (GONE.includes(error.status)) this.store.remove("asked");
      throw error;
    }
    this.changed();
  }

  /** Ask again for a take whose answer was lost, and forget one that has ended. @param {Api.RequestRead[]} requests as the service has them */
  async resume(requests) {
    const { holding } = this;
    const held = requests.find(({ id }) => id === holding?.request);
    if (holding && held && !isMine(held, holding)) this.store.remove("held");
    const asked = this.store.read("asked");
    const isTaken = requests.some(({ id, state, taken_by: by }) => id === asked?.request && state === "taken" && by === asked.operator);
    if (isTaken) await this.send().catch(() => {});
  }

  /** Show a sign of life; a take that has ended is forgotten, and its answer is still welcome. */
  async beat() {
    const { holding } = this;
    if (!holding) return;
    try {
      await post(`/requests/${holding.request}/heartbeat`, { take: holding.take });
    } catch (error) {
      if (!GONE.includes(error.status)) return;
      this.store.remove("held");
      this.changed();
    }
  }

  /** Forget the take of a request that is answered. @param {string} request id */
  end(request) {
    if (this.holding?.request === request) this.store.remove("held");
  }

  /** Give the request back without an answer. */
  async release() {
    const { holding } = this;
    if (!holding) return;
    try {
      await post(`/requests/${holding.request}/release`, { take: holding.take });
    } catch (error) {
      if (!GONE.includes(error.status)) throw error;
    }
    this.store.remove("held");
    this.changed();
  }
}
