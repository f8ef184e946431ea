// @ts-check
/** The part of the form about reality: simulated, or a robot on a bench, with samples from before in a table that is checked line by line. */

import { postFile } from "../../lib/api.js";
import { h } from "../../lib/dom.js";
import { count, readableName } from "../../lib/format.js";
import { stringify } from "../../lib/json.js";
import { table } from "../../lib/table.js";
import { LIMITS, plainName, pluginName } from "./draft.js";
import { errorRoom, field, folded, numberField, pluginField } from "./fields.js";

/** @typedef {import("../new.js").Form} Form */

const LINES_SHOWN = 50;

/** @type {Page.Choices} */
const KINDS = [["simulated", "Simulated, with hidden parameters"], ["physical", "Physical: a robot on a bench"], ["recorded", "Recorded: a pool of motions"]];

/** @type {[probes: string, words: string][]} */
const PROBES = [["each", "after each iteration"], ["last", "after the last iteration"], ["never", "never: the curve has the best sample so far"]];

/** @type {Record<string, [label: string, hint: string]>} */
const LIMIT_WORDS = {
  joint_speed: ["Joint speed at most", "rad/s"], torque: ["Torque at most", "N·m"],
  tilt: ["Tilt of the base at most", "rad"], height: ["Height of the base at least", "m"],
};

/** @type {Record<string, [label: string, hint: string]>} */
const NOISE_WORDS = {
  noise: ["Noise of a measured fitness", "standard deviation as a share of about what an evolution in reality reaches; readings have their sensors’ noise then"],
  noise_unit: ["The same in the unit of fitness", "in place of the share: equal for all strategies"],
};

/** Return the fields that say what reality is. @param {Form} form */
export function realityFields(form) {
  const { draft: { bench, strategies }, places, catalogue } = form;
  const set = (/** @type {string} */ kind) => {
    bench.isPhysical = kind === "physical";
    bench.isRecorded = kind === "recorded";
    const baselines = catalogue.strategies.filter(({ details }) => details.baseline).map(({ name }) => name);
    const one = strategies.find(({ name, on }) => on && !baselines.includes(name));
    if (bench.isPhysical) for (const strategy of strategies) strategy.on = strategy === one;
    form.remake();
  };
  return [
    field({ label: "Reality", value: bench.isRecorded ? "recorded" : bench.isPhysical ? "physical" : "simulated", set, pointer: "/reality/kind", places, choices: KINDS,
      hint: bench.isPhysical || bench.isRecorded ? "" : "its parameters are hidden from the strategies, and from everybody until the study has ended" }),
    ...(bench.isRecorded ? recorded(form) : bench.isPhysical ? physical(form) : [])];
}

/** Return which recordings there are, and how many are held out. @param {Form} form */
const recorded = ({ draft: { bench }, places, setter }) => [
  h("p", { class: "note" }, "Strategies select from the recordings of a pool, which “gaplab pool add” stores; each selects a recording once, and none selects by fitness."),
  field({ label: "Pool", value: bench.pool, set: setter(bench, "pool"), pointer: "/reality/pool", places, maxlength: 100 }),
  numberField({ label: "Held out", hint: "share of the pool that no tuning sees", value: bench.heldOut, set: setter(bench, "heldOut"), pointer: "/reality/held_out", places, placeholder: "0.2" })];

/** Return the fields of reality that are rarely needed. @param {Form} form */
export const rareReality = (form) => (form.draft.bench.isRecorded ? [] : form.draft.bench.isPhysical ? limits(form) : simulated(form));

/** Return the engine and the hidden parameters of a simulated reality. @param {Form} form */
function simulated(form) {
  const { draft: { realityEngine, realityParameters, realityNoise, tunables }, places, catalogue } = form;
  const named = [...new Set([...tunables.map(({ name }) => name), ...Object.keys(realityParameters)])];
  const fields = named.flatMap((name) => {
    const plugin = catalogue.tunables.find((other) => other.name === plainName(name));
    return plugin?.available ? [numberField({
      label: readableName(name), value: realityParameters[name], set: form.setter(realityParameters, name), places, placeholder: "the robot’s own",
      pointer: `/reality/parameters/${name}`, hint: name.includes("=") ? "" : `${plugin.details.least} to ${plugin.details.greatest}` })] : [];
  });
  return [
    pluginField(form, "Engine of reality", realityEngine, catalogue.engines, "/reality/engine", "The engine of the simulators"),
    h("p", { class: "note" }, "Hidden parameters of reality"), h("div", { class: "fields" }, ...fields),
    ...Object.entries(NOISE_WORDS).map(([name, [label, hint]]) => numberField({
      label, hint, value: realityNoise[name], set: form.setter(realityNoise, name), pointer: `/reality/${name}`, places, placeholder: "none" })),
    probesField(form, "each")];
}

/** Return what is measured on a bench, and what is known already. @param {Form} form */
function physical(form) {
  const { draft: { bench, robot }, places } = form;
  return [
    h("p", { class: "note" }, "Measurements are requested on the page “Bench”, and repetitions wait for them, for a year if need be. Each strategy needs runs of its own, so one is ticked."),
    field({ label: "Name of the bench", hint: "one measurement is taken at a time on it", value: bench.bench, set: form.setter(bench, "bench"), pointer: "/reality/bench", places, maxlength: 200, placeholder: robot.name }),
    numberField({ label: "Repeats of each measurement", hint: "their mean is the fitness, their spread the noise", value: bench.repeats, set: form.setter(bench, "repeats"), pointer: "/reality/repeats", places, placeholder: "1" }),
    samplesField(form)];
}

/** Return when the transferred controller is measured, and the limits of the robot. @param {Form} form */
function limits(form) {
  const { draft: { bench }, places } = form;
  const fields = LIMITS.map((name) => numberField({
    label: LIMIT_WORDS[name][0], hint: LIMIT_WORDS[name][1], value: bench.limits[name], set: form.setter(bench.limits, name),
    pointer: `/reality/limits/${name}`, places, placeholder: "not checked" }));
  return [
    probesField(form, "last"),
    h("p", { class: "note" }, "Limits of the robot: before a controller is offered, the simulators forecast whether it keeps them."),
    h("div", { class: "fields" }, ...fields),
    field({ label: "Beyond them", value: bench.beyond, set: form.setter(bench, "beyond"), pointer: "/reality/beyond", places,
      choices: [["", "offer it with a warning"], ["refuse", "refuse it: it counts as failed"]] })];
}

/** @param {Form} form @param {string} usual */
function probesField(form, usual) {
  const { draft: { bench }, places } = form;
  /** @type {Page.Choices} */
  const choices = [["", `${PROBES.find(([name]) => name === usual)?.[1]}, the default`], ...PROBES];
  return field({ label: "The transferred controller is measured", value: bench.probes, set: form.setter(bench, "probes"), pointer: "/reality/probes", places, choices });
}

/** Return the parameters of a query that name the chosen plug-ins. @param {Record<string, Page.PluginDraft>} drafts */
const chosen = (drafts) => Object.fromEntries(Object.entries(drafts).filter(([, { name }]) => name).map(([kind, plugin]) => [kind, stringify(pluginName(plugin))]));

/** Return the field for samples from before the experiment, and what it holds so far. @param {Form} form */
function samplesField(form) {
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
  return h("div", { class: "paste" }, folded("samples", "Samples that were measured before", [
    h("label", { for: "samples" }, "Table as CSV"), area,
    h("small", { id: "samples-hint", class: "note" }, hintOf(genes)), h("p", {}, file),
    h("button", { type: "button", class: "quiet", onclick: () => check(area.value) }, "Check and use the table"), room, told], bench.samples.length > 0));
}

/** Return the columns that a table needs. @param {number} genes */
export const hintOf = (genes) =>
  `Columns ${genes === 1 ? "gene_0" : genes === 2 ? "gene_0, gene_1" : `gene_0 to gene_${genes - 1}`}, then value, or value_1, value_2 and so on for repeats. The first simulators are tuned on them.`;

/** Return the beginning of a table. @param {number} genes */
export function exampleOf(genes) {
  const names = Array.from({ length: Math.min(genes, 3) }, (_, gene) => `gene_${gene}`);
  return `${[...names, ...(genes > 3 ? ["…"] : []), "value_1", "value_2"].join(",")}\n`;
}

/** Return in words what is used. @param {{ values: number[] }[]} samples */
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
