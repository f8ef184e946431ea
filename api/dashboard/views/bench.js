// @ts-check
/** The bench: what an operator measures next, beside the robot, on a phone whose network comes and goes. */

import { get } from "../lib/api.js";
import { conflictList } from "../lib/bench/corrections.js";
import { isWanted, nextRequest } from "../lib/bench/requests.js";
import { answers, onAnswers, sendWaiting } from "../lib/bench/sender.js";
import { h, refill, setText } from "../lib/dom.js";
import { keepAges } from "../lib/live.js";
import { failed } from "../lib/placeholders.js";
import { nextCard, nothingToDo, otherList } from "./bench/next_card.js";
import { keepPolling } from "./bench/polling.js";
import { sentList } from "./bench/sent.js";
import { Take } from "./bench/take.js";

const MOST = 100;
const NOT_FOUND = 404;
const LOST = [401, 403, 404];  // the view cannot go on

/**
 * Fill `root` with the requests of the bench or the experiment that the parameters name, or of all, until `signal`.
 * @param {HTMLElement} root
 * @param {URLSearchParams} parameters
 * @param {AbortSignal} signal
 */
export async function show(root, parameters, signal) {
  const query = { bench: parameters.get("bench"), experiment: parameters.get("experiment") };
  const catalogue = /** @type {Api.Catalogue} */ (await get("/catalogue", {}, signal));
  const functions = new Set(catalogue.robots.filter(({ details }) => details.function === true).map(({ name }) => name));
  const connection = h("p", { class: "remark warned offline", role: "status", hidden: true });
  const places = { benches: h("div"), next: h("div"), conflicts: h("div"), others: h("div") };
  /** @type {Page.BenchView} */
  const view = {
    signal, functions, requests: [], conflicts: [], form: null, chosen: parameters.get("request"), take: new Take(signal, () => draw()),
    choose(id) {
      view.chosen = id;
      draw();
      places.next.querySelector("h2")?.focus();
    },
    answered(id) {
      view.take.end(id);
      view.requests = view.requests.filter((request) => request.id !== id);
      draw();
      sendWaiting();
    },
    refresh: () => polling.now(),
  };
  const sent = sentList(view);
  let waited = 0;

  function draw() {
    const waiting = new Set(answers.list().filter(({ state }) => state === "waiting").map(({ request }) => request));
    const { next, others } = nextRequest(view.requests, { holding: view.take.holding, chosen: view.chosen, answered: waiting });
    const focused = document.activeElement;
    refill(places.next, JSON.stringify([next && keyOf(next), view.take.holding, waiting.size > 0]), () => (next ? nextCard(next, view) : nothingToDo(query, waiting.size > 0)));
    if (focused instanceof HTMLElement && focused !== document.activeElement && places.next.contains(focused)) focused.focus();  // the form moved to a new card
    const benches = query.bench ? [] : [...new Set(view.requests.map(({ bench }) => bench))].sort();
    refill(places.benches, JSON.stringify(benches), () => benchLinks(benches));
    refill(places.others, JSON.stringify(others.map(keyOf)), () => otherList(others, view));
    refill(places.conflicts, JSON.stringify(view.conflicts), () => conflictList(view.conflicts, view));
    sent.update();
    if (waiting.size < waited) polling.now();  // an answer arrived: the next request may follow
    waited = waiting.size;
  }

  const ask = async (/** @type {number} */ waitS, /** @type {AbortSignal} */ patience) => {
    const shown = { ...query, limit: MOST };
    const [waiting, undecided] = await Promise.all([
      get("/requests", { ...shown, wait_s: waitS }, patience),
      get("/requests", { ...shown, pending: false, conflicts: true }, patience),
    ]);
    const requests = await withChosen(waiting.items, view.chosen, patience);
    if (signal.aborted) return 0;
    Object.assign(view, { requests, conflicts: undecided.items });
    await view.take.resume(view.requests);
    draw();
    return requests.length;
  };
  const told = (/** @type {any} */ error) => {
    if (signal.aborted) return;
    connection.hidden = !error;
    if (error) setText(connection, `The service does not answer${error.status ? `: ${error.message}` : ""}. What you enter is kept in this browser, and sent as soon as it does.`);
    else sendWaiting();
  };

  const title = query.experiment ? "Bench of an experiment" : query.bench ? `Bench “${query.bench}”` : "Bench";
  root.replaceChildren(h("h1", {}, title), places.benches, connection, places.next, sent.element, places.conflicts, places.others);
  keepAges(root, signal);
  onAnswers(draw, signal);
  draw();
  const polling = keepPolling(ask, told, signal, (error) => {
    if (LOST.includes(error.status)) root.replaceChildren(failed(error, () => dispatchEvent(new HashChangeEvent("hashchange"))));
    return LOST.includes(error.status);
  });
}

/**
 * Return the requests with the one that the reader chose, if it still waits: it may be beyond the first page.
 * @param {Api.RequestRead[]} requests
 * @param {string | null} chosen
 * @param {AbortSignal} signal
 */
export async function withChosen(requests, chosen, signal) {
  if (!chosen || requests.length < MOST || requests.some(({ id }) => id === chosen)) return requests;
  try {
    /** @type {Api.RequestRead} */
    const request = await get(`/requests/${chosen}`, {}, signal);
    return isWanted(request) ? [...requests, request] : requests;
  } catch (error) {
    if (error.status === NOT_FOUND) return requests;
    throw error;
  }
}

/** Return links to the benches, if there are several. @param {string[]} benches */
const benchLinks = (benches) => (benches.length < 2 ? null
  : h("p", { class: "links" }, ...benches.flatMap((bench) => [h("a", { href: `#/bench?${new URLSearchParams({ bench })}` }, bench), " "])));

/** Return what of a request is shown; times pass without a change. @param {Api.RequestRead} request */
const keyOf = ({ id, state, takes, taken_by: by, busy, answers: given, safety }) => [id, state, takes, by, busy, given.length, safety];
