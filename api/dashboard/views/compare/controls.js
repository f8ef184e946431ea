// @ts-check
/** How the figure is drawn: against what, and with which band. */

import { bandSelect, fitnessSelect } from "../../lib/curve_options.js";
import { h } from "../../lib/dom.js";
import { AXES } from "./address.js";

/**
 * Return the controls; each change is in the address at once.
 *
 * @param {Page.CompareView} view
 * @returns {Page.ComparePart}
 */
export function controls(view) {
  const radios = Object.keys(AXES).map((value) => h("input", { type: "radio", name: "x", value, onchange: () => { view.change({ x: value }); } }));
  const axes = radios.map((radio) => h("label", {}, radio, AXES[radio.value]));
  const changeCost = () => {
    if (cost.checkValidity() && cost.value !== "") view.change({ cost_s: Number(cost.value) });
  };
  const cost = h("input", { type: "number", min: 0, step: "any", class: "short", onchange: changeCost });
  const costLabel = h("label", {}, "each real evaluation costs ", cost, " s");
  const band = bandSelect({ onchange: () => { view.change({ band: band.value }); } });
  const fitness = fitnessSelect({ onchange: () => { view.change({ fitness: fitness.value }); } });
  const each = h("input", { type: "checkbox", onchange: () => { view.change({ each: each.checked }); } });
  const element = h("div", { class: "controls" },
    h("fieldset", {}, h("legend", {}, "Against"), ...axes, costLabel),
    h("label", {}, "Fitness ", fitness), h("label", {}, "Band ", band), h("label", {}, each, " Each repetition"));
  const update = () => {
    const { choice } = view;
    for (const radio of radios) radio.checked = radio.value === choice.x;
    costLabel.hidden = choice.x !== "time";
    if (document.activeElement !== cost) cost.value = String(choice.cost_s);
    band.value = choice.band;
    fitness.value = choice.fitness;
    each.checked = choice.each;
  };
  return { element, update };
}
