/** Numbers, times and names as people read them. */

const NUMBER = new Intl.NumberFormat("en", { maximumFractionDigits: 3 });
const COUNT = new Intl.NumberFormat("en");

/** A number in three digits, or a dash. */
export const number = (value) => (value === null || value === undefined ? "–" : NUMBER.format(value));

/** A number with three digits after the point, for columns. */
export const fixed = (value) => (value === null || value === undefined ? "–" : value.toFixed(3).replace("-", "−"));

/** A whole number in groups of three. */
export const count = (value) => (value === null || value === undefined ? "–" : COUNT.format(value));

/** Seconds as `3 min`, `2 h`, `5 days`, or `7 years`. */
export function duration(seconds) {
  if (seconds === null || seconds === undefined) return "–";
  if (seconds > 0 && seconds < 0.5) return "less than 1 s";
  for (const [unit, size, until] of [["s", 1, 90], ["min", 60, 5400], ["h", 3600, 172800]]) {
    if (seconds < until) return `${Math.round(seconds / size)} ${unit}`;
  }
  const days = Math.round(seconds / 86400);
  return days < 730 ? `${days} days` : `${Math.round(days / 365)} years`;
}

/** How long ago a time was. */
export const age = (time) => `${duration(Math.max(0, (Date.now() - Date.parse(time)) / 1000))} ago`;

/** `simulated_fit` as *Simulated fit*; a name that a person gave stays. */
export function spoken(name) {
  return /^[a-z][a-z0-9_]*$/.test(name) ? (name[0].toUpperCase() + name.slice(1)).replaceAll("_", " ") : name;
}
