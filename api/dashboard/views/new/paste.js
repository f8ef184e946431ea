// @ts-check
/** A spec from elsewhere: pasted as JSON, or in the address. The service checks it before it fills the form. */

import { post } from "../../lib/api.js";
import { h } from "../../lib/dom.js";
import { parse } from "../../lib/json.js";

/** @typedef {Record<string, any>} Spec */

/**
 * Return the spec of a study for a spec of a study or an experiment, whose one strategy becomes a list.
 *
 * @param {Spec} spec
 * @returns {Spec}
 */
export function studyOf(spec) {
  if (!("strategy" in spec) || "strategies" in spec) return spec;
  const { strategy, ...others } = spec;
  return { ...others, strategies: [strategy] };
}

/**
 * Return the object in a text of JSON.
 *
 * @param {string} text
 * @returns {Spec}
 */
export function specIn(text) {
  let found;
  try {
    found = parse(text);
  } catch (error) {
    throw new Error(`This is not JSON: ${error.message}`, { cause: error });
  }
  if (found === null || typeof found !== "object" || Array.isArray(found)) throw new Error('A spec is an object, like {"budget": "smoke"}.');
  return found;
}

/**
 * Return a field for pasted JSON, and a function that takes a text as if it had been pasted.
 *
 * @param {(spec: Spec) => void} fill fills the form
 */
export function pasteField(fill) {
  const area = h("textarea", { id: "pasted", rows: 8, spellcheck: "false", placeholder: '{"budget": "smoke", "repetitions": 3}' });
  const troubles = h("div", { role: "alert", class: "trouble" });
  const element = h("details", { class: "paste" }, h("summary", {}, "Paste a spec"),
    h("label", { for: "pasted" }, "Spec of a study or an experiment, as JSON"), area, troubles,
    h("button", { type: "button", onclick: () => { take(area.value); } }, "Fill the form"));
  const take = async (/** @type {string} */ text) => {
    area.value = text;
    troubles.replaceChildren();
    try {
      const spec = studyOf(specIn(text));
      await post("/studies/estimate", spec);
      fill(spec);
      element.open = false;
    } catch (error) {
      element.open = true;
      const errors = error.errors?.length ? error.errors : [{ pointer: "", message: error.message }];
      troubles.replaceChildren(...errors.map((/** @type {{ pointer: string, message: string }} */ { pointer, message }) =>
        h("p", {}, pointer ? h("code", {}, pointer) : null, ` ${message}`)));
    }
  };
  return { element, take };
}
