/** Files of the service: a plain link where no token is asked for, else fetched with the token and handed on. */

import { blob, search } from "./api.js";
import { h } from "./dom.js";
import { token } from "./token.js";

const FORMATS = ["svg", "png", "pdf"];

/** A link that saves what is at `path` as `name`. */
export function download(words, path, query, name) {
  const status = h("span", { role: "alert", class: "failed" });
  const click = async (event) => {
    if (!token()) return;
    event.preventDefault();
    status.textContent = "";
    try {
      save(await blob(path, query), name);
    } catch (error) {
      status.textContent = ` ${error.message}`;
    }
  };
  const link = h("a", { href: path.replace(/^\//, "") + search(query), download: name, onclick: click }, words);
  return h("span", { class: "download" }, link, status);
}

/** The figure in every format for papers, and what else there is of it: `[words, path, query, name]` each. */
export function figureFiles(kind, query, name, ...others) {
  const files = FORMATS.map((format) => download(format.toUpperCase(), `/figures/${kind}`, { ...query, format }, `${name}.${format}`));
  return h("p", { class: "files" }, "Save as ", ...[...files, ...others.map((each) => download(...each))].flatMap((each) => [each, " "]));
}

function save(content, name) {
  const address = URL.createObjectURL(content);
  const link = h("a", { href: address, download: name, hidden: true });
  document.body.append(link);
  link.click();
  link.remove();
  setTimeout(() => URL.revokeObjectURL(address), 60_000);
}
