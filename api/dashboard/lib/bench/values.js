// @ts-check
/** Measured values as people type and read them. */

import { number } from "../format.js";

const NUMBER = /^[+-]?(\d+([.,]\d*)?|[.,]\d+)(e[+-]?\d+)?$/i;

/**
 * Return the number that was typed, also with a decimal comma; null if it is none.
 *
 * @param {string} text
 */
export function typedNumber(text) {
  const plain = text.trim().replace("−", "-");
  const value = Number(plain.replace(",", "."));
  return NUMBER.test(plain) && Number.isFinite(value) ? value : null;
}

/**
 * Return the values of all repeats, with a message for each that is none; all mistakes are told at once.
 *
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

/**
 * Return a typed number with the other sign: keyboards of phones for decimals have no minus.
 *
 * @param {string} text
 */
export const withOtherSign = (text) => (/^\s*[-−]/.test(text) ? text.replace(/^\s*[-−]/, "") : `-${text.trim()}`);

/**
 * Return an answer in words: its values with their unit, its traces, or why there are none.
 *
 * @param {{ values?: number[] | null, failed?: string | null, traces?: unknown[] }} answer
 * @param {string} [unit]
 */
export const answerText = ({ values, failed, traces = [] }, unit = "") =>
  (values ? `${values.map(number).join(", ")}${unit ? ` ${unit}` : ""}` : failed ? `failed: ${failed}` : `${traces.length} traces`);

/**
 * Return which measurement a request asks for.
 *
 * @param {Pick<Api.RequestRead, "repetition" | "iteration" | "kind">} request
 */
export const requestWords = ({ repetition, iteration, kind }) => `${kind} of iteration ${iteration}, repetition ${repetition}`;
