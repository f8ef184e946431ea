/** What the study would cost, the button, and the spec in every form to copy. */

import { copyButton } from "../../lib/copy.js";
import { h } from "../../lib/dom.js";
import { count, duration, spoken } from "../../lib/format.js";
import { written } from "../../lib/json.js";
import { framed } from "../../lib/table.js";
import { tabs } from "../../lib/tabs.js";

const quoted = (text) => `'${text.replaceAll("'", "'\\''")}'`;

/** The panel's element, and what the form tells it. */
export function panel() {
  const cost = h("div", { class: "cost", role: "status" }, "Checking…");
  const trouble = h("div", { class: "failed", role: "alert" });
  const button = h("button", { type: "submit", class: "submit" }, "Submit the study");
  const code = { json: h("code"), curl: h("code"), python: h("code") };
  const text = (name) => h("div", {}, copyButton("Copy", () => code[name].textContent), framed(`The spec as ${name}`, h("pre", {}, code[name])));
  const forms = tabs("The spec", [["json", "JSON", text("json")], ["curl", "curl", text("curl")], ["python", "Python", text("python")]], "json", () => {});
  const element = h("aside", { class: "panel card", "aria-label": "Cost and spec" }, h("h2", {}, "What it costs"), cost, trouble, button, forms);
  const show = (spec) => {
    const base = new URL(".", location.href).href;
    const json = written(spec, 2);
    code.json.textContent = json;
    code.curl.textContent = `curl -X POST ${base}studies \\\n  -H 'Content-Type: application/json' \\\n  -d ${quoted(written(spec))}`;
    code.python.textContent = [
      "import json", "", "from gaplab import Client", "", `spec = json.loads(${pythonText(json)})`,
      `with Client("${base.replace(/\/$/, "")}") as gaplab:`, "    study = gaplab.submit(spec)",
    ].join("\n");
  };
  const estimate = (found) => cost.replaceChildren(...costs(found));
  const refuse = (errors, words) => {
    trouble.replaceChildren(...errors.map((each) => h("p", {}, h("code", {}, each.pointer || "spec"), ` ${each.message}`)));
    if (words) cost.replaceChildren(h("p", {}, words));
  };
  const busy = (is) => {
    button.disabled = is;
    button.textContent = is ? "Submitting…" : "Submit the study";
  };
  return { element, show, estimate, refuse, busy };
}

/** A raw text of Python, which JSON fits into unless it has three quotes in a row. */
const pythonText = (json) => (json.includes("'''") ? JSON.stringify(json) : `r'''${json}'''`);

function costs({ rollouts, seconds, cores, core_seconds: coreSeconds, engines, experiments, supervisors }) {
  const big = h("p", { class: "big" }, h("strong", {}, duration(seconds)), ` on ${count(cores)} ${cores === 1 ? "core" : "cores"}`);
  const work = h("p", {}, `${count(rollouts)} rollouts at most, ${duration(coreSeconds)} of one core, if nothing else is waiting.`);
  const paces = engines.map(({ engine, seconds_per_rollout: pace, measured }) =>
    h("p", { class: "note" }, `${spoken(engine)}: ${milliseconds(pace)} a rollout, ${measured ? "as measured here" : "as usual; not measured here yet"}.`));
  const idle = supervisors ? null : h("p", { class: "remark" }, "No worker is running now: it will wait until one does (gaplab serve, or python -m workers).");
  const rows = experiments.map((each) => h("tr", {}, h("th", { scope: "row" }, spoken(each.name)),
    h("td", {}, `${count(each.repetitions)} ×`), h("td", {}, count(each.rollouts)), h("td", {}, duration(each.core_seconds))));
  const heads = ["Experiment", "Repetitions", "Rollouts", "One core"].map((each) => h("th", { scope: "col" }, each));
  const table = h("table", {}, h("caption", { class: "away" }, "Cost of each experiment"),
    h("thead", {}, h("tr", {}, ...heads)), h("tbody", {}, ...rows));
  return [big, work, idle, ...paces, h("details", {}, h("summary", {}, "By experiment"), framed("Cost of each experiment", table))].filter(Boolean);
}

function milliseconds(seconds) {
  const found = seconds * 1000;
  return `${found < 10 ? found.toPrecision(2) : Math.round(found)} ms`;
}
