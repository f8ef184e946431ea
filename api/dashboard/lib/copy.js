// @ts-check
/** Text for the clipboard. */

import { h } from "./dom.js";

const SHOWN_MS = 2000;

/**
 * Return a button that copies what `text()` returns, and says whether it could.
 * @param {string} label
 * @param {() => string | Promise<string>} text
 */
export function copyButton(label, text) {
  const press = async () => {
    try {
      button.textContent = await copy(await text()) ? "Copied" : "Copying is not permitted here";
    } catch (error) {
      button.textContent = `Not copied: ${error.message}`;
    }
    setTimeout(() => { button.textContent = label; }, SHOWN_MS);
  };
  const button = h("button", { type: "button", class: "quiet", onclick: press }, label);
  return button;
}

/** Copy a text, and return whether that worked. Pages that are not on loopback or HTTPS have the older command only. @param {string} text */
async function copy(text) {
  if (navigator.clipboard) return await navigator.clipboard.writeText(text).then(() => true, () => false);
  const area = h("textarea", { class: "away" });
  area.value = text;
  document.body.append(area);
  area.select();
  const isDone = document.execCommand("copy");
  area.remove();
  return isDone;
}
