// @ts-check
/** The margin within which two experiments count as equivalent. */

import { h } from "../../lib/dom.js";
import { positive } from "./address.js";

const PERCENT = 100;

/**
 * Return the field for the margin, in the unit of fitness or as a share of the direct baseline.
 *
 * @param {Page.CompareView} view
 * @returns {Page.ComparePart}
 */
export function marginField(view) {
  const change = () => {
    const width = positive(number.value);
    const isShare = unit.value === "share";
    view.change({ margin: isShare ? null : width, margin_of_direct: isShare && width ? width / PERCENT : null });
  };
  const number = h("input", { type: "number", min: 0, step: "any", class: "short", placeholder: "none", onchange: change });
  const unit = h("select", { "aria-label": "Unit of the margin", onchange: change },
    h("option", { value: "fitness" }, "in the unit of fitness"), h("option", { value: "share" }, "% of direct"));
  const element = h("span", { class: "margin" }, h("label", {}, "equivalent within ± ", number), " ", unit);
  const update = () => {
    const { margin, margin_of_direct: share } = view.choice;
    if (margin !== null || share !== null) unit.value = share === null ? "fitness" : "share";
    if (document.activeElement !== number) number.value = String(share === null ? margin ?? "" : Number((share * PERCENT).toPrecision(12)));
  };
  return { element, update };
}
