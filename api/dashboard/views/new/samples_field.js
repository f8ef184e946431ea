// @ts-check
/** Samples from before an experiment: a table that is pasted or chosen, checked line by line. */

import { postFile } from "../../lib/api.js";
import { h } from "../../lib/dom.js";
import { count } from "../../lib/format.js";
import { stringify } from "../../lib/json.js";
import { table } from "../../lib/table.js";
import { pluginName } from "./draft.js";
import { errorRoom } from "./fields.js";

/** @typedef {import("../new.js").Form} Form */

const LINES_SHOWN = 50;

/**
 * Return the parameters of a query that name the chosen plug-ins.
 *
 * @param {Record<string, Page.PluginDraft>} drafts
 */
const chosen = (drafts) => Object.fromEntries(Object.entries(drafts).filter(([, { name }]) => name).map(([kind, plugin]) => [kind, stringify(pluginName(plugin))]));

/**
 * Return the field, and what it holds so far.
 *
 * @param {Form} form
 */
export function samplesField(form) {
  const { draft: { bench, robot, controller, task }, catalogue, places } = form;
  const ownGenes = catalogue.robots.find(({ name }) => name === robot.name)?.details.genes ?? 1;
  const genes = controller.name ? 1 : Number(ownGenes);
  const area = h("textarea", { id: "samples", rows: 5, spellcheck: "false", "aria-describedby": "samples-hint", placeholder: exampleOf(genes) });
  const file = h("input", { type: "file", accept: ".csv,.tsv,.txt,text/csv", "aria-label": "Choose a CSV file" });
  const told = h("div", { role: "status" });
  const room = errorRoom();
  const remove = () => {
    bench.samples = [];
    form.remake();
  };
  const showKept = () => told.replaceChildren(...(bench.samples.length ? [h("p", {}, `✓ ${keptText(bench.samples)} `, h("button", { type: "button", class: "link", onclick: remove }, "Remove"))] : []));

  /** @param {string} text */
  async function check(text) {
    told.replaceChildren(h("p", {}, "Checking…"));
    try {
      const plugin = pluginName(robot);
      const query = { robot: robot.name, options: stringify(typeof plugin === "string" ? {} : plugin.options), ...chosen({ controller, task }) };
      /** @type {Api.SamplesRead} */
      const found = await postFile("/samples/check", query, text, "text/csv");
      if (!told.isConnected) return;
      bench.samples = found.samples.map(({ genome, values, readings, unit }) => ({ genome, values, ...(readings ? { readings } : {}), ...(unit ? { unit } : {}) }));
      if (found.errors.length) told.replaceChildren(...errorBlocks(found));
      else showKept();
      form.changed();
    } catch (error) {
      told.replaceChildren(h("p", { class: "failed" }, error.message));
    }
  }
  file.addEventListener("change", async () => {
    if (!file.files?.length) return;
    area.value = await file.files[0].text();
    await check(area.value);
  });
  showKept();
  places.add(() => (bench.isPhysical ? "/reality/samples" : null), area, room);
  return h("details", { class: "paste", open: bench.samples.length > 0 }, h("summary", {}, "Samples that were measured before"),
    h("label", { for: "samples" }, "Table as CSV"), area,
    h("small", { id: "samples-hint", class: "note" }, hintOf(genes)), h("p", {}, file),
    h("button", { type: "button", class: "quiet", onclick: () => check(area.value) }, "Check and use the table"), room, told);
}

/**
 * Return the columns that a table needs.
 *
 * @param {number} genes
 */
export const hintOf = (genes) =>
  `Columns ${genes === 1 ? "gene_0" : genes === 2 ? "gene_0, gene_1" : `gene_0 to gene_${genes - 1}`}, then value, or value_1, value_2 and so on for repeats. The first simulators are tuned on them.`;

/**
 * Return the beginning of a table.
 *
 * @param {number} genes
 */
export function exampleOf(genes) {
  const names = Array.from({ length: Math.min(genes, 3) }, (_, gene) => `gene_${gene}`);
  return `${[...names, ...(genes > 3 ? ["…"] : []), "value_1", "value_2"].join(",")}\n`;
}

/**
 * Return in words what is used.
 *
 * @param {{ values: number[] }[]} samples
 */
export function keptText(samples) {
  const repeats = samples.map(({ values }) => values.length);
  const [least, most] = [Math.min(...repeats), Math.max(...repeats)];
  const each = least === most ? (most === 1 ? "1 value" : `${most} values`) : `${least} to ${most} values`;
  return `${count(samples.length)} ${samples.length === 1 ? "sample" : "samples"} of ${each} each.`;
}

/** @param {Api.SamplesRead} found */
function errorBlocks({ errors, more }) {
  const shown = errors.slice(0, LINES_SHOWN);
  const rest = errors.length - shown.length + more;
  const rows = shown.map(({ line, column, message, permitted }) => [line, column ?? "–", message, permitted ?? ""]);
  return [h("p", { class: "failed" }, `${count(errors.length + more)} ${errors.length + more === 1 ? "error" : "errors"}; no sample is used until the table is right.`),
    table("Errors in the table", ["Line", "Column", "What is wrong", "Permitted"], rows), rest ? h("p", { class: "note" }, `and ${count(rest)} more`) : null].filter((block) => block !== null);
}
