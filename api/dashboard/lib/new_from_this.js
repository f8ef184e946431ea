// @ts-check
/** The button that opens the form filled with the spec of a study or an experiment. */

import { getTagged } from "./api.js";
import { h } from "./dom.js";
import { stringify } from "./json.js";

/**
 * Return the button.
 *
 * @param {string} path of the study or the experiment
 */
export function newFromThis(path) {
  const status = h("span", { role: "alert", class: "failed" });
  const press = async () => {
    status.textContent = "";
    try {
      const { spec, remarks } = (await getTagged(`${path}/spec`)).value;  // the seed keeps all its digits
      if (spec) location.hash = `#/new?${new URLSearchParams({ spec: stringify(spec), ...(remarks.length ? { note: remarks.join("; ") } : {}) })}`;
      else status.textContent = ` ${remarks.join("; ")}`;
    } catch (error) {
      status.textContent = ` ${error.message}`;
    }
  };
  return h("span", {}, h("button", { type: "button", class: "quiet small", onclick: press }, "New from this"), status);
}
