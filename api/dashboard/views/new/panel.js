// @ts-check
/** Beside the form, or below it on a phone: what the study costs and the button, always in view, and the spec to copy in every form. */

import { copyButton } from "../../lib/copy.js";
import { h } from "../../lib/dom.js";
import { count, duration, readableName, titleOf } from "../../lib/format.js";
import { stringify } from "../../lib/json.js";
import { framed, table } from "../../lib/table.js";
import { tabs } from "../../lib/tabs.js";

const SUBMIT = "Submit the study";
const NO_WORKERS = "No worker is running now. The study will wait until one does (gaplab serve, or python -m workers).";

/** Return the panel's element, and the functions by which the form fills it. */
export function panel() {
  const cost = h("div", { class: "cost", role: "status" }, "Checking…");
  const errorList = h("div", { class: "failed", role: "alert" });
  const button = h("button", { type: "submit", class: "submit" }, SUBMIT);
  const code = { json: h("code"), curl: h("code"), python: h("code") };
  const snippet = (/** @type {keyof typeof code} */ name) =>
    h("div", {}, copyButton("Copy", () => code[name].textContent), framed(`The spec as ${name}`, h("pre", {}, code[name])));
  const forms = tabs("The spec", [
    ["json", "JSON", snippet("json")], ["curl", "curl", snippet("curl")], ["python", "Python", snippet("python")]], "json", () => {});
  const breakdown = h("div", { class: "cost" });
  return {
    element: h("aside", { class: "side", "aria-label": "Cost and spec" },
      h("div", { class: "panel card" }, h("h2", {}, "What it costs"), h("div", { class: "submission" }, cost, button), errorList),
      h("div", { class: "panel-more card" }, breakdown, forms)),
    /** @param {Record<string, any>} spec */
    showSpec(spec) {
      const base = new URL(".", location.href).href;
      const json = stringify(spec, 2);
      code.json.textContent = json;
      code.curl.textContent = curlLines(base, stringify(spec));
      code.python.textContent = pythonLines(base, json);
    },
    /** @param {Api.EstimateRead} estimate */
    showCost(estimate) {
      cost.replaceChildren(...costBlocks(estimate));
      breakdown.replaceChildren(...costDetails(estimate));
    },
    /**
     * Show errors that have no place in the form, and words instead of the cost.
     * @param {{ pointer: string, message: string }[]} errors
     * @param {string | null} [words]
     */
    showErrors(errors, words = null) {
      errorList.replaceChildren(...errors.map(({ pointer, message }) => h("p", {}, h("code", {}, pointer || "spec"), ` ${message}`)));
      if (words) cost.replaceChildren(h("p", {}, words));
    },
    /** @param {boolean} isBusy */
    setBusy(isBusy) {
      button.disabled = isBusy;
      button.textContent = isBusy ? "Submitting…" : SUBMIT;
    },
  };
}

/** Return the submission as a line for a shell. @param {string} base @param {string} json */
export const curlLines = (base, json) =>
  `curl -X POST ${base}studies \\\n  -H 'Content-Type: application/json' \\\n  -d '${json.replaceAll("'", "'\\''")}'`;

/**
 * Return the submission as a program. A raw text of Python holds any JSON without three quotes in a row.
 * @param {string} base
 * @param {string} json
 */
export function pythonLines(base, json) {
  const text = json.includes("'''") ? JSON.stringify(json) : `r'''${json}'''`;
  return [
    "import json", "", "from gaplab import Client", "", `spec = json.loads(${text})`,
    `with Client("${base.replace(/\/$/, "")}") as gaplab:`, "    study = gaplab.submit(spec)",
  ].join("\n");
}

/** @param {Api.EstimateRead} estimate */
function costBlocks({ rollouts, seconds, cores, experiments }) {
  const runs = experiments.reduce((sum, each) => sum + each.runs, 0);
  const real = runs ? [h("p", { class: "big" }, h("strong", {}, `${count(runs)} ${runs === 1 ? "run" : "runs"}`), " of the real robot")] : [];
  return [...real,
    h("p", { class: "big" }, h("strong", {}, duration(seconds)), ` on ${count(cores)} ${cores === 1 ? "core" : "cores"}`),
    h("p", {}, `${count(rollouts)} rollouts at most`)];
}

/** @param {Api.EstimateRead} estimate */
function costDetails({ core_seconds: coreSeconds, engines, experiments, supervisors }) {
  const paces = engines.map(({ engine, seconds_per_rollout: pace, measured }) =>
    h("p", { class: "note" }, `${readableName(engine)}: ${milliseconds(pace)} a rollout, ${measured ? "measured here" : "the usual time; not measured here yet"}.`));
  const rows = experiments.map((experiment) => [titleOf(experiment),
    `${count(experiment.repetitions)} ×`, count(experiment.rollouts), duration(experiment.core_seconds)]);
  const costs = table("Cost of each experiment", ["Experiment", "Repetitions", "Rollouts", "One core"], rows);
  return [...(supervisors ? [] : [h("p", { class: "remark" }, NO_WORKERS)]), h("p", { class: "note" }, `${duration(coreSeconds)} of one core, if nothing else is waiting.`), ...paces,
    h("details", {}, h("summary", {}, "By experiment"), costs)];
}

/** @param {number} seconds */
function milliseconds(seconds) {
  const value = seconds * 1000;
  return `${value < 10 ? value.toPrecision(2) : Math.round(value)} ms`;
}
