/** A comparison as an address, so that it can be shared. */

import { BANDS } from "../../lib/bands.js";

export const AXES = { evaluations: "Real-world evaluations", rollouts: "Rollouts", time: "Time" };
export const TESTS = { student: "Student’s t, as in the paper", welch: "Welch’s t", mann_whitney: "Mann–Whitney" };

const COST_S = 60;

/** What the address asks for; what it has wrong is as if it were left out. */
export function chosen(parameters) {
  const among = (name, permitted, otherwise) => (parameters.get(name) in permitted ? parameters.get(name) : otherwise);
  return {
    experiments: ids(parameters.get("experiments")),
    studies: ids(parameters.get("studies")),
    x: among("x", AXES, "evaluations"),
    cost_s: positive(parameters.get("cost_s")) ?? COST_S,
    band: among("band", BANDS, ""),
    each: parameters.get("each") === "true",
    test: among("test", TESTS, "student"),
    from: whole(parameters.get("from")),
    to: whole(parameters.get("to")),
  };
}

/** The address of a comparison, as short as it can be. */
export function address({ experiments, x, cost_s: cost, band, each, test, from, to }) {
  const parts = [
    experiments.length ? ["experiments", experiments.join(",")] : null,
    x === "evaluations" ? null : ["x", x],
    x === "time" ? ["cost_s", cost] : null,
    band ? ["band", band] : null,
    each ? ["each", "true"] : null,
    test === "student" ? null : ["test", test],
    from === null ? null : ["from", from],
    to === null ? null : ["to", to],
  ].filter(Boolean);
  return `#/compare${parts.length ? "?" : ""}${parts.map(([name, value]) => `${name}=${value}`).join("&")}`;
}

/** What the figure is asked for with. */
export const drawing = ({ experiments, x, cost_s: cost, band, each }) => ({
  experiment: experiments, x: x === "evaluations" ? null : x, cost_s: x === "time" ? cost : null, band, each: each || null,
});

const ids = (text) => [...new Set((text ?? "").split(",").filter((each) => /^[\w-]{1,64}$/.test(each)))];

const positive = (text) => (text !== null && Number.isFinite(Number(text)) && Number(text) >= 0 && text !== "" ? Number(text) : null);

/** A whole number from 0, or nothing. */
export const whole = (text) => (/^\d{1,4}$/.test(text ?? "") ? Number(text) : null);
