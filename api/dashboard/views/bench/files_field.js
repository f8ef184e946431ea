// @ts-check
/** Files of an answer, like photographs, or its traces: each is stored as soon as it is chosen, and the answer names it by its hash. */

import { postFile } from "../../lib/api.js";
import { h, setText } from "../../lib/dom.js";

/** @typedef {{ id: string, name: string }} Kept a stored file */

/**
 * Return the field, and the files that it has.
 *
 * @param {{ id: string, label: string }} words
 * @param {Kept[]} given
 * @param {() => void} changed
 */
export function filesField({ id: name, label }, given, changed) {
  let kept = given;
  const input = h("input", { id: name, type: "file", multiple: true });
  const list = h("ul", { class: "rows" });
  const status = h("small", { role: "status" });
  const draw = () => list.replaceChildren(...kept.map((file) => {
    const remove = () => {
      kept = kept.filter((other) => other !== file);
      changed();
      draw();
    };
    return h("li", {}, h("span", {}, `✓ ${file.name} `, h("button", { type: "button", class: "link", "aria-label": `Remove ${file.name}`, onclick: remove }, "Remove")));
  }));
  input.addEventListener("change", async () => {
    for (const file of input.files ?? []) {
      setText(status, `Sending ${file.name}…`);
      try {
        const { id } = await postFile("/attachments", { name: file.name.slice(0, 200) }, file, file.type || "application/octet-stream");
        kept = [...kept.filter((other) => other.id !== id), { id, name: file.name }];
        setText(status, "");
      } catch (error) {
        setText(status, `${file.name} is not stored: ${error.message} Choose it again.`);
      }
      changed();
      draw();
    }
    input.value = "";
  });
  draw();
  const element = h("div", { class: "field" }, h("label", { for: name }, label), input, status, list);
  return { element, kept: () => kept };
}
