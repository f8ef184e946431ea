// @ts-check
/** A comparison as an address, so that it can be shared. */

import { BANDS, FITNESS } from "../../lib/curve_options.js";

/** @type {Record<string, string>} */
export const AXES = { evaluations: "Real-world evaluations", rollouts: "Rollouts", time: "Time", cost: "Cost" };

/**
 * What each axis needs to know, by its name in a query.
 * @type {Record<string, string[]>}
 */
const NEEDED = { evaluations: [], rollouts: [], time: ["cost_s", "rollout_s", "cores"], cost: ["cost_s", "rollout_s", "cores", "machine", "attention", "wear"] };

/** The same in words; what is left out has the service's default. @type {Record<string, string>} */
export const MODEL = {
  cost_s: "each real evaluation costs, in s", rollout_s: "a rollout, in s; empty: as measured", cores: "on so many cores",
  machine: "price of an hour of the machine", attention: "price of an hour of real evaluations", wear: "price of the wear of each",
};

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
    model: { ...Object.fromEntries(Object.keys(MODEL).map((name) => [name, nonNegative(parameters.get(name))])), cost_s: nonNegative(parameters.get("cost_s")) ?? COST_S },
    equal: parameters.get("equal") === "true",
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
export function addressOf({ experiments, x, model, equal, band, fitness, each, test, from, to, margin, margin_of_direct: share }) {
  const parts = Object.entries({
    experiments: experiments.join(","),
    x: x === "evaluations" ? "" : x,
    ...Object.fromEntries(NEEDED[x].map((name) => [name, model[name] ?? ""])),
    equal: (x !== "evaluations" && equal) || "",
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

/** Return the part of a query that says what curves are drawn against. @param {Page.Comparison} comparison */
export const costQuery = ({ x, model }) => ({ x: x === "evaluations" ? null : x, ...Object.fromEntries(NEEDED[x].map((name) => [name, model[name]])) });

/** Return which part of the model an axis needs. @param {string} x */
export const neededBy = (x) => NEEDED[x];

/**
 * Return the query of the figure.
 *
 * @param {Page.Comparison} comparison
 */
export const figureQuery = ({ experiments, band, fitness, each, ...choice }) => ({
  study: experiments, ...costQuery(/** @type {Page.Comparison} */ (choice)), band, fitness, each: each || null,
});

/** @param {string | null} text */
const ids = (text) => [...new Set((text ?? "").split(",").filter((id) => /^[\w-]{1,64}$/.test(id)))];

/** @param {string | null} text */
export const nonNegative = (text) => (text && Number.isFinite(Number(text)) && Number(text) >= 0 ? Number(text) : null);

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
