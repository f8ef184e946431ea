/** The same from a terminal or a program: lines to copy. */

import { copyButton } from "../../lib/copy.js";
import { h } from "../../lib/dom.js";
import { framed } from "../../lib/table.js";

/** Lines that read this study. */
export function lines({ id }) {
  const base = new URL(".", location.href).href.replace(/\/$/, "");
  return h("details", { class: "calls" }, h("summary", {}, "From a terminal or a program"),
    call("curl", `curl '${base}/studies/${id}/curves?format=csv'`),
    call("Command", `GAPLAB_URL=${base} gaplab show ${id}`),
    call("Python", `from gaplab import Client\n\nwith Client("${base}") as gaplab:\n    curves = gaplab.curves(["${id}"])`));
}

/** A line or a few, with what they are, to copy. */
export function call(words, text) {
  return h("div", { class: "call" }, h("div", { class: "titled" }, h("h3", {}, words), copyButton("Copy", () => text)),
    framed(words, h("pre", {}, h("code", {}, text))));
}
