// @ts-check
/** Links to files of the service. With a token, the file is fetched by script, since a plain link cannot send it. */

import { getFile, queryString, token } from "./api.js";
import { h } from "./dom.js";

const FORMATS = ["svg", "png", "pdf"];

/**
 * Return a link that saves the file at a path.
 *
 * @param {string} label
 * @param {string} path
 * @param {Page.Query} query
 * @param {string} name of the saved file
 * @param {string} [busy] what the service does meanwhile; a file that takes long, or may be refused, is fetched by script
 */
export function downloadLink(label, path, query, name, busy = "") {
  const progress = h("span", { role: "status", class: "note" });
  const failure = h("span", { role: "alert", class: "failed" });
  const click = async (/** @type {Event} */ event) => {
    if (!token() && !busy) return;
    event.preventDefault();
    failure.textContent = "";
    progress.textContent = busy && ` ${busy}…`;
    try {
      save(await getFile(path, query), name);
    } catch (error) {
      failure.textContent = ` ${error.message}`;
    }
    progress.textContent = "";
  };
  const link = h("a", { href: path.replace(/^\//, "") + queryString(query), download: name, onclick: click }, label);
  return h("span", { class: "download" }, link, progress, failure);
}

/**
 * Return links to a figure in every format, and to other files of it.
 *
 * @param {string} kind of the figure
 * @param {Page.Query} query
 * @param {string} name of the files, without their ending
 * @param {...Parameters<typeof downloadLink>} others
 */
export function figureDownloads(kind, query, name, ...others) {
  const files = FORMATS.map((format) => downloadLink(format.toUpperCase(), `/figures/${kind}`, { ...query, format }, `${name}.${format}`));
  const links = [...files, ...others.map((other) => downloadLink(...other))];
  return h("p", { class: "files" }, "Save as ", ...links.flatMap((link) => [link, " "]));
}

/**
 * Save content under a name, as a link to a file does.
 *
 * @param {Blob} content
 * @param {string} name
 */
export function save(content, name) {
  const address = URL.createObjectURL(content);
  const link = h("a", { href: address, download: name, hidden: true });
  document.body.append(link);
  link.click();
  link.remove();
  setTimeout(() => URL.revokeObjectURL(address), 60_000);
}
