// @ts-check
/** The tests of a range as a table to take along: copied as CSV or LaTeX, or saved. */

import { getFile } from "../../lib/api.js";
import { copyButton } from "../../lib/copy.js";
import { downloadLink } from "../../lib/downloads.js";
import { h } from "../../lib/dom.js";

/** @type {[label: string, format: string, name: string][]} */
const FORMATS = [["CSV", "csv", "gaplab-comparisons.csv"], ["LaTeX", "latex", "gaplab-comparisons.tex"]];

/**
 * Return buttons that copy the tests of all pairs over a range, and links that save them.
 *
 * @param {Page.Query} asked what the comparison was asked for
 */
export function exports(asked) {
  const query = (/** @type {string} */ format) => ({ ...asked, format });
  const copies = FORMATS.map(([label, format]) =>
    copyButton(`Copy as ${label}`, async () => (await getFile("/comparisons", query(format))).text()));
  const links = FORMATS.map(([label, format, name]) => downloadLink(label, "/comparisons", query(format), name));
  return h("p", { class: "files exports" }, ...copies.flatMap((button) => [button, " "]), "Save as ", ...links.flatMap((link) => [link, " "]));
}
