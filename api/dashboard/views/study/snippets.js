// @ts-check
/** Lines to copy that read a study from a terminal or a program. */

import { copyButton } from "../../lib/copy.js";
import { h } from "../../lib/dom.js";
import { framed } from "../../lib/table.js";

/**
 * Return the lines that read a study.
 *
 * @param {Page.StudyPage} page
 */
export function snippets({ id }) {
  const base = new URL(".", location.href).href.replace(/\/$/, "");
  return h("details", { class: "calls" }, h("summary", {}, "From a terminal or a program"),
    snippet("curl", `curl '${base}/studies/${id}/curves?format=csv'`),
    snippet("Command", `GAPLAB_URL=${base} gaplab show ${id}`),
    snippet("Python", `from gaplab import Client\n\nwith Client("${base}") as gaplab:\n    curves = gaplab.curves(["${id}"])`));
}

/**
 * @param {string} title
 * @param {string} text
 */
function snippet(title, text) {
  return h("div", { class: "call" }, h("div", { class: "titled" }, h("h3", {}, title), copyButton("Copy", () => text)),
    framed(title, h("pre", {}, h("code", {}, text))));
}
