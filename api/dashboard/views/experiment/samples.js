// @ts-check
/** Every real-world evaluation of an experiment, page by page, each with a link to its replay. */

import { queryString } from "../../lib/api.js";
import { h } from "../../lib/dom.js";
import { number } from "../../lib/format.js";
import { empty } from "../../lib/placeholders.js";
import { table } from "../../lib/table.js";
import { pagedList } from "./paged.js";

const PAGE_SIZE = 25;
const CHOICES = [["", "samples and probes"], ["sample", "samples, which are learned from"], ["probe", "probes, which are only looked at"]];
const KINDS = ["measured", "probed"];
const COLUMNS = ["Repetition", "Iteration", "Kind", "Fitness in reality", "Measured by", "When", "Replay"];

/**
 * Return the table, with its filters above and the way to its other pages below.
 *
 * @param {Page.ExperimentPage} page
 */
export function samples(page) {
  const kind = h("select", {}, ...CHOICES.map(([value, label]) => h("option", { value }, label)));
  const repetition = h("input", { type: "number", min: 0, max: 1000000, step: 1, placeholder: "all", class: "short" });
  const render = (/** @type {Api.SampleRead[]} */ items) =>
    [items.length ? table("Real-world evaluations", COLUMNS, items.map((sample) => row(page, sample))) : empty("Nothing was tried in reality yet.")];
  return pagedList(page, {
    path: `/experiments/${page.id}/samples`, size: PAGE_SIZE, kinds: KINDS, render,
    filters: h("p", { class: "options" }, h("label", {}, "Show ", kind), h("label", {}, "Repetition ", repetition)),
    query: () => ({ kind: kind.value, repetition: repetition.value }),
  });
}

/**
 * Return a link to the replay of a controller; a function is stepped through instead.
 *
 * @param {Page.ExperimentPage} page
 * @param {{ repetition: number, iteration: number, kind: Api.MeasurementKind }} measured
 */
export function replayLink({ id, isFunction }, { repetition, iteration, kind }) {
  const query = { experiment: id, repetition, iteration };
  const address = isFunction ? `#/toy${queryString(query)}` : `#/replay${queryString({ ...query, kind: kind === "sample" ? "sample" : "transfer" })}`;
  const label = isFunction ? "Step" : "Replay";
  return h("a", { href: address, "aria-label": `${label}, repetition ${repetition}, iteration ${iteration}` }, label);
}

/**
 * @param {Page.ExperimentPage} page
 * @param {Api.SampleRead} sample
 */
function row(page, sample) {
  const { repetition, iteration, kind, fitness } = sample;
  return [repetition, iteration, kind, fitness === null ? "physics failed" : number(fitness),
    sample.measured_by, new Date(sample.measured_at).toLocaleString(), replayLink(page, sample)];
}
