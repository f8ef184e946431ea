// @ts-check
/** Numbers, times and names as people read them; a value that is missing is a dash. */

/** @typedef {number | null | undefined} Value */

const NUMBER = new Intl.NumberFormat("en", { maximumFractionDigits: 3 });
const COUNT = new Intl.NumberFormat("en");
const MISSING = "–";

/** @type {(value: Value) => value is null | undefined} */
const isMissing = (value) => value === null || value === undefined;

/** Format a number with at most three decimals. @param {Value} value */
export const number = (value) => (isMissing(value) ? MISSING : NUMBER.format(value));

/** Format a number with exactly three decimals, for columns. @param {Value} value */
export const fixed = (value) => (isMissing(value) ? MISSING : value.toFixed(3).replace("-", "−"));

/** Format a number with three significant digits, and all digits before the point: a small difference does not become 0. @param {Value} value */
export const threeDigits = (value) => {
  if (isMissing(value)) return MISSING;
  return String(Math.abs(value) < 1000 ? Number(value.toPrecision(3)) : Math.round(value)).replaceAll("-", "−");
};

/** Format a whole number in groups of three digits. @param {Value} value */
export const count = (value) => (isMissing(value) ? MISSING : COUNT.format(value));

/** Format a share between 0 and 1 in whole per cent, rounded down: 100 % is complete. @param {number} share */
export const percent = (share) => `${Math.floor(100 * share)} %`;

/** Format seconds as `3 min`, `2 h`, `5 days`, or `7 years`. @param {Value} seconds */
export function duration(seconds) {
  if (isMissing(seconds)) return MISSING;
  if (seconds > 0 && seconds < 0.5) return "less than 1 s";
  for (const { unit, size, until } of [{ unit: "s", size: 1, until: 90 }, { unit: "min", size: 60, until: 5400 }, { unit: "h", size: 3600, until: 172800 }]) {
    if (seconds < until) return `${Math.round(seconds / size)} ${unit}`;
  }
  const days = Math.round(seconds / 86400);
  return days < 730 ? `${days} days` : `${Math.round(days / 365)} years`;
}

/** @type {(known: number) => string} */
export const fromBefore = (known) => (known ? ` (and ${count(known)} from before)` : "");

/** Format a number of real-world evaluations, with that of samples from before. @param {{ evaluations: number, known: number }} fitness */
export const evaluationsText = ({ evaluations, known }) => `${count(evaluations)} real-world evaluation${evaluations === 1 ? "" : "s"}${fromBefore(known)}`;

/** Format the time between two moments; a dash unless both are known. @param {string | null} start @param {string | null} end */
export const timeBetween = (start, end) => duration(start && end ? (Date.parse(end) - Date.parse(start)) / 1000 : null);

/** Format how long ago a moment was. @param {string} time */
export const age = (time) => `${duration(Math.max(0, (Date.now() - Date.parse(time)) / 1000))} ago`;

/** @type {Record<string, string>} */
const PROPER = JSON.parse(globalThis.document?.documentElement.dataset.names ?? "{}");

/** Write the name of a plug-in: `some_name` as *Some name*, and a proper name as it is. @param {string} name */
export function readableName(name) {
  return PROPER[name] ?? (/^[a-z][a-z0-9_]*$/.test(name) ? (name[0].toUpperCase() + name.slice(1)).replaceAll("_", " ") : name);
}

/**
 * Write the name of an experiment as a person gave it; that of its strategy, which it has by default, is written as of a plug-in.
 * @param {{ name: string, strategy: string }} experiment
 */
export const titleOf = ({ name, strategy }) => (name === strategy ? readableName(name) : name);
