/** Text for the clipboard. */

import { h } from "./dom.js";

const SHOWN_MS = 2000;

/** A button that copies what `text()` says, and says that it did. */
export function copyButton(words, text) {
  const button = h("button", { type: "button", class: "quiet", onclick: async () => {
    const done = await copied(text());
    button.textContent = done ? "Copied" : "Copying is not permitted here";
    setTimeout(() => { button.textContent = words; }, SHOWN_MS);
  } }, words);
  return button;
}

/** Whether it was copied; pages that are not on loopback or HTTPS have no clipboard, only the older command. */
async function copied(text) {
  if (navigator.clipboard) return navigator.clipboard.writeText(text).then(() => true, () => false);
  const area = h("textarea", { class: "away" });
  area.value = text;
  document.body.append(area);
  area.select();
  const done = document.execCommand("copy");
  area.remove();
  return done;
}
