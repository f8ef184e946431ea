// @ts-check
/** Which request an operator does next. */

/** @typedef {{ request: string, take: number, operator: string }} Holding the take that this browser holds */

/**
 * Return whether a request still asks for a measurement.
 *
 * @param {Pick<Api.RequestRead, "state">} request
 */
export const isWanted = ({ state }) => ["open", "taken", "stuck"].includes(state);

/**
 * Return whether no measurement of an experiment begins in its state.
 *
 * @param {Api.State} state
 */
export const isAtRest = (state) => ["PAUSING", "PAUSED", "STOPPING"].includes(state);

/**
 * Return whether this browser holds a request.
 *
 * @param {Api.RequestRead} request
 * @param {Holding | null} holding
 */
export const isMine = ({ id, state, takes }, holding) => state === "taken" && holding?.request === id && holding.take === takes;

/**
 * Return the request to do next, and the others: the one that is held here, else the chosen one, else the oldest that is free.
 *
 * @param {Api.RequestRead[]} requests the oldest first
 * @param {{ holding?: Holding | null, chosen?: string | null, answered?: Set<string> }} how `answered`: ids of requests whose answers wait here
 * @returns {{ next: Api.RequestRead | null, others: Api.RequestRead[] }}
 */
export function nextRequest(requests, { holding = null, chosen = null, answered = new Set() }) {
  const wanted = requests.filter(({ id }) => !answered.has(id));
  const open = wanted.filter(({ state }) => state === "open");
  const next = wanted.find((request) => isMine(request, holding)) ?? wanted.find(({ id }) => id === chosen)
    ?? open.find(({ busy }) => !busy) ?? open[0] ?? null;
  return { next, others: wanted.filter((request) => request !== next) };
}

/**
 * Return how long to wait before another try, in milliseconds: twice as long each time, up to half a minute.
 *
 * @param {number} failures in a row
 */
export const backoffMs = (failures) => (failures ? Math.min(30_000, 1000 * 2 ** (failures - 1)) : 0);
