/** How the figure is drawn: against what, with which band. */

import { bandChoice } from "../../lib/bands.js";
import { h } from "../../lib/dom.js";
import { AXES } from "./address.js";

/** The controls; a change is in the address at once. */
export function controls(view) {
  const axes = Object.entries(AXES).map(([value, words]) =>
    h("label", {}, h("input", { type: "radio", name: "x", value, onchange: () => view.change({ x: value }) }), words));
  const spend = () => cost.checkValidity() && cost.value !== "" && view.change({ cost_s: Number(cost.value) });
  const cost = h("input", { type: "number", min: 0, step: "any", class: "short", onchange: spend });
  const costs = h("label", {}, "each real evaluation costs ", cost, " s");
  const band = bandChoice({ onchange: () => view.change({ band: band.value }) });
  const each = h("input", { type: "checkbox", onchange: () => view.change({ each: each.checked }) });
  const element = h("div", { class: "controls" },
    h("fieldset", {}, h("legend", {}, "Against"), ...axes, costs),
    h("label", {}, "Band ", band), h("label", {}, each, " Each repetition"));
  const update = () => {
    const { choice } = view;
    for (const radio of element.querySelectorAll("[type=radio]")) radio.checked = radio.value === choice.x;
    costs.hidden = choice.x !== "time";
    if (document.activeElement !== cost) cost.value = choice.cost_s;
    band.value = choice.band;
    each.checked = choice.each;
  };
  return { element, update };
}
