// @ts-check
/** The resolved spec of an experiment, to read and to submit again. */

import { copyButton } from "../../lib/copy.js";
import { h } from "../../lib/dom.js";
import { stringify } from "../../lib/json.js";
import { framed } from "../../lib/table.js";

const NOTE = "The complete spec. Reality’s parameters are null until the experiment has ended.";

/**
 * Return the spec as JSON, with a button that copies it.
 *
 * @param {Page.ExperimentPage} page
 */
export function spec(page) {
  const text = () => stringify(page.experiment.spec, 2);
  const code = h("code");
  const place = framed("Spec as JSON", h("pre", {}, code));
  page.sections.add(place, ["extended", "completed", "failed", "cancelled"], async () => {
    await page.reload();
    code.textContent = text();
  });
  return [h("p", {}, copyButton("Copy the spec", text)), h("p", { class: "note" }, NOTE), place];
}
