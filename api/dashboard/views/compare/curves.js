// @ts-check
/** The figure of the comparison: its files, against what it is drawn, and with which band. */

import { bandSelect, fitnessSelect } from "../../lib/curve_options.js";
import { h } from "../../lib/dom.js";
import { figureDownloads } from "../../lib/downloads.js";
import { plot } from "../../lib/plot.js";
import { CURVE_KINDS } from "../../lib/event_kinds.js";
import { AXES, figureQuery, MODEL, neededBy, nonNegative } from "./address.js";

/**
 * Return the controls; each change is in the address at once.
 *
 * @param {Page.CompareView} view
 * @returns {Page.Updatable}
 */
export function controls(view) {
  const radios = Object.keys(AXES).map((value) => h("input", { type: "radio", name: "x", value, onchange: () => view.change({ x: value }) }));
  const axes = radios.map((radio) => h("label", {}, radio, AXES[radio.value]));
  const model = Object.entries(MODEL).map(([name, text]) => {
    const change = () => {
      if (input.checkValidity()) view.change({ model: { ...view.choice.model, [name]: nonNegative(input.value) } });
    };
    const input = h("input", { type: "number", min: 0, step: "any", class: "short", onchange: change });
    return { name, input, label: h("label", {}, `${text} `, input) };
  });
  const band = bandSelect({ onchange: () => view.change({ band: band.value }) });
  const fitness = fitnessSelect({ onchange: () => view.change({ fitness: fitness.value }) });
  const each = h("input", { type: "checkbox", onchange: () => view.change({ each: each.checked }) });
  const element = h("div", { class: "controls" },
    h("fieldset", {}, h("legend", {}, "Against"), ...axes, ...model.map(({ label }) => label)),
    h("label", {}, "Fitness ", fitness), h("label", {}, "Band ", band), h("label", {}, each, " Each repetition"));
  const update = () => {
    const { choice } = view;
    for (const radio of radios) radio.checked = radio.value === choice.x;
    for (const { name, input, label } of model) {
      label.hidden = !neededBy(choice.x).includes(name);
      if (document.activeElement !== input) input.value = String(choice.model[name] ?? "");
    }
    band.value = choice.band;
    fitness.value = choice.fitness;
    each.checked = choice.each;
  };
  return { element, update };
}

/**
 * Return the curves, which are drawn again after another choice or an event.
 *
 * @param {Page.CompareView} view
 * @returns {Page.Updatable}
 */
export function figure(view) {
  const place = h("div", { class: "large" });
  const downloads = h("div");
  const draw = plot(place, "curves", view.signal);
  let lastKey = "";
  const queryNow = () => figureQuery({ ...view.choice, experiments: view.cache.known(view.choice.experiments) });
  const load = async () => {
    const query = queryNow();
    return !query.study.length || await draw(query) ? undefined : "failed";
  };
  const loadNow = view.sections.add(place, CURVE_KINDS, load);
  const update = () => {
    const query = queryNow();
    const key = JSON.stringify(query);
    if (key === lastKey || !query.study.length) return;
    lastKey = key;
    downloads.replaceChildren(figureDownloads("curves", query, "gaplab-curves",
      ["CSV", "/curves", { study: query.study, fitness: query.fitness, format: "csv" }, "gaplab-curves.csv"]));
    loadNow();
  };
  return { element: h("section", { class: "card", "aria-label": "Curves" }, place, downloads), update };
}
