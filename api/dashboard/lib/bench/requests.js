// @ts-check
/** Requests for measurements: which one an operator does next, in words, and measured values as people type and read them. */

import { number } from "../format.js";

const NUMBER = /^[+-]?(\d+([.,]\d*)?|[.,]\d+)(e[+-]?\d+)?$/i;

/** Return the number that was typed, also with a decimal comma; null if it is none. @param {string} text */
export function typedNumber(text) {
  const plain = text.trim().replace("−", "-");
  const value = Number(plain.replace(",", "."));
  return NUMBER.test(plain) && Number.isFinite(value) ? value : null;
}

/**
 * Return the values of all repeats, with a message for each that is none; all mistakes are told at once.
 * @param {string[]} texts
 * @returns {{ values: number[], mistakes: (string | null)[] }}
 */
export function typedValues(texts) {
  const values = texts.map(typedNumber);
  const mistakes = texts.map((text, index) => {
    if (values[index] !== null) return null;
    return text.trim() ? `“${text.trim()}” is not a number, such as 0.41` : "a number is missing";
  });
  return { values: values.filter((value) => value !== null), mistakes };
}

/** Return a typed number with the other sign: keyboards of phones for decimals have no minus. @param {string} text */
export const withOtherSign = (text) => (/^\s*[-−]/.test(text) ? text.replace(/^\s*[-−]/, "") : `-${text.trim()}`);

/**
 * Return an answer in words: its values with their unit, its traces, or why there are none.
 * @param {{ values?: number[] | null, failed?: string | null, traces?: unknown[] }} answer
 * @param {string} [unit]
 */
export const answerText = ({ values, failed, traces = [] }, unit = "") =>
  (values ? `${values.map(number).join(", ")}${unit ? ` ${unit}` : ""}` : failed ? `failed: ${failed}` : `${traces.length} traces`);

/** Return which measurement a request asks for. @param {Pick<Api.RequestRead, "repetition" | "iteration" | "kind">} request */
export const requestWords = ({ repetition, iteration, kind }) => `${kind} of iteration ${iteration}, repetition ${repetition}`;

/** Return the state of a request in words. @param {Pick<Api.RequestRead, "state" | "taken_by" | "unanswered" | "busy">} request */
export function stateText({ state, taken_by: by, unanswered, busy }) {
  if (state === "taken") return `▶ taken by ${by}`;
  if (state === "stuck") return `✕ stuck: taken ${unanswered} times without an answer`;
  return busy ? "○ open, its bench is busy" : "○ open";
}

/** @typedef {{ request: string, take: number, operator: string }} Holding the take that this browser holds */

/** Return whether a request still asks for a measurement. @param {Pick<Api.RequestRead, "state">} request */
export const isWanted = ({ state }) => ["open", "taken", "stuck"].includes(state);

/** Return whether no measurement of an experiment begins in its state. @param {Api.State} state */
export const isAtRest = (state) => ["PAUSING", "PAUSED", "STOPPING"].includes(state);

/** Return whether this browser holds a request. @param {Api.RequestRead} request @param {Holding | null} holding */
export const isMine = ({ id, state, takes }, holding) => state === "taken" && holding?.request === id && holding.take === takes;

/**
 * Return the request to do next, and the others: the one that is held here, else the chosen one, else the oldest that is free.
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
