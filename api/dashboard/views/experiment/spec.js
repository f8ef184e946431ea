/** The resolved spec, to read and to submit again. */

import { copyButton } from "../../lib/copy.js";
import { h } from "../../lib/dom.js";
import { written } from "../../lib/json.js";
import { framed } from "../../lib/table.js";

/** The spec as JSON; reality's parameters are null in it until the experiment has ended. */
export function spec(page) {
  const text = () => written(page.experiment.spec, 2);
  const code = h("code");
  const place = framed("Spec as JSON", h("pre", {}, code));
  page.parts.add(place, ["extended", "completed", "failed", "cancelled"], async () => {
    await page.look();
    code.textContent = text();
  });
  const note = h("p", { class: "note" }, "Nothing is left out of it. Reality’s parameters are null until the experiment has ended.");
  return [h("p", {}, copyButton("Copy the spec", text)), note, place];
}
