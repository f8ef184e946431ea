// @ts-check
/** A comparison as an address, so that it can be shared. */

import { BANDS, FITNESS } from "../../lib/curve_options.js";

/** @type {Record<string, string>} */
export const AXES = { evaluations: "Real-world evaluations", rollouts: "Rollouts", time: "Time" };

/** @type {Record<Page.Comparison["test"], { label: string, short: string }>} */
export const TESTS = {
  trusted: { label: "Welch’s t, paired where streams are shared", short: "Trusted" },
  student: { label: "Student’s t, as in the paper", short: "Student" },
  welch: { label: "Welch’s t", short: "Welch" },
  mann_whitney: { label: "Mann–Whitney", short: "Mann–Whitney" },
  paired_t: { label: "Paired t", short: "Paired t" },
  wilcoxon: { label: "Wilcoxon, paired", short: "Wilcoxon" },
  brown_forsythe: { label: "Brown–Forsythe, of the spread", short: "Brown–Forsythe" },
};

const COST_S = 60;

/**
 * Return the comparison at an address; an invalid value is replaced by its default.
 *
 * @param {URLSearchParams} parameters
 * @returns {Page.Comparison & { studies: string[] }}
 */
export function comparisonOf(parameters) {
  /** @type {(name: string, permitted: object, otherwise: string) => any} */
  const among = (name, permitted, otherwise) => (Object.hasOwn(permitted, parameters.get(name) ?? "") ? parameters.get(name) ?? "" : otherwise);
  return {
    experiments: ids(parameters.get("experiments")),
    studies: ids(parameters.get("studies")),
    x: among("x", AXES, "evaluations"),
    cost_s: nonNegative(parameters.get("cost_s")) ?? COST_S,
    band: among("band", BANDS, ""),
    fitness: among("fitness", FITNESS, ""),
    each: parameters.get("each") === "true",
    test: among("test", TESTS, "trusted"),
    from: wholeNumber(parameters.get("from")),
    to: wholeNumber(parameters.get("to")),
    margin: positive(parameters.get("margin")),
    margin_of_direct: positive(parameters.get("margin_of_direct")),
  };
}

/**
 * Return the shortest address of a comparison.
 *
 * @param {Page.Comparison} comparison
 */
export function addressOf({ experiments, x, cost_s: cost, band, fitness, each, test, from, to, margin, margin_of_direct: share }) {
  const parts = Object.entries({
    experiments: experiments.join(","),
    x: x === "evaluations" ? "" : x,
    cost_s: x === "time" ? cost : "",
    band,
    fitness,
    each: each || "",
    test: test === "trusted" ? "" : test,
    from: from ?? "",
    to: to ?? "",
    margin: margin ?? "",
    margin_of_direct: share ?? "",
  }).filter(([, value]) => value !== "");
  return `#/compare${parts.length ? "?" : ""}${parts.map(([name, value]) => `${name}=${value}`).join("&")}`;
}

/**
 * Return the query of the figure.
 *
 * @param {Page.Comparison} comparison
 */
export const figureQuery = ({ experiments, x, cost_s: cost, band, fitness, each }) => ({
  study: experiments, x: x === "evaluations" ? null : x, cost_s: x === "time" ? cost : null, band, fitness, each: each || null,
});

/** @param {string | null} text */
const ids = (text) => [...new Set((text ?? "").split(",").filter((id) => /^[\w-]{1,64}$/.test(id)))];

/** @param {string | null} text */
const nonNegative = (text) => (text && Number.isFinite(Number(text)) && Number(text) >= 0 ? Number(text) : null);

/**
 * Return the number above 0 that a text is, or null.
 *
 * @param {string | null} text
 */
export const positive = (text) => nonNegative(text) || null;

/**
 * Return the whole number from 0 to 9999 that a text is, or null.
 *
 * @param {string | null} text
 */
export const wholeNumber = (text) => (/^\d{1,4}$/.test(text ?? "") ? Number(text) : null);
