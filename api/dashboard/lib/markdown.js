// @ts-check
/** Notes: the service renders Markdown, and the page builds its own elements from what it knows of the result. */

import { get } from "./api.js";
import { h, refill } from "./dom.js";

/** The elements of rendered Markdown; the content of any other is shown without it. */
const KNOWN = new Set(["p", "br", "hr", "em", "strong", "s", "code", "pre", "blockquote", "ul", "ol", "li",
  "table", "thead", "tbody", "tr", "th", "td", "a", "h1", "h2", "h3", "h4", "h5", "h6"]);

const BELOW_PAGE_TITLE = /** @type {Record<string, string>} */ ({ h1: "h3", h2: "h4", h3: "h5", h4: "h6" });

const HARMLESS = /^(https?:\/\/|mailto:|#)/i;

/**
 * Return the nodes of rendered Markdown. No element, attribute or address that is not listed here reaches the page.
 * @param {string} html
 * @returns {Page.Child[]}
 */
export const markdownNodes = (html) => copied(new DOMParser().parseFromString(html, "text/html").body);

/** @param {Node} parent @returns {Page.Child[]} */
function copied(parent) {
  return [...parent.childNodes].map((node) => {
    if (node.nodeType === Node.TEXT_NODE) return node.textContent;
    if (!(node instanceof Element)) return null;
    const name = node.localName;
    if (!KNOWN.has(name)) return name === "script" || name === "style" ? null : copied(node);
    return h(/** @type {"p"} */ (BELOW_PAGE_TITLE[name] ?? name), name === "a" ? linkAttributes(node) : {}, ...copied(node));
  });
}

/** @param {Element} link */
function linkAttributes(link) {
  const href = link.getAttribute("href") ?? "";
  if (!HARMLESS.test(href)) return {};
  return href.startsWith("#") ? { href } : { href, rel: "noopener noreferrer nofollow", target: "_blank" };
}

/**
 * Return the notes of a study or an experiment; until they are rendered they are plain text.
 * @param {string} path of the study or the experiment
 * @param {AbortSignal} signal
 * @returns {Page.Updatable<string | null>}
 */
export function notesBlock(path, signal) {
  const element = h("div", { class: "notes" });
  const update = (/** @type {string | null} */ notes) => {
    element.hidden = !notes;
    refill(element, notes ?? "", () => {
      if (notes) render(notes).catch((error) => console.warn(error.message));
      return h("p", { class: "plain" }, notes);
    });
  };
  const render = async (/** @type {string} */ notes) => {
    const { html } = /** @type {Api.NotesRead} */ (await get(`${path}/notes`, {}, signal));
    if (element.dataset.key === notes && !signal.aborted) refill(element, `${notes} `, () => markdownNodes(html));
    element.dataset.key = notes;
  };
  return { element, update };
}
