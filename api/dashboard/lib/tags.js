// @ts-check
/** Tags of studies and experiments; each leads to what else has it. */

import { h, refill } from "./dom.js";

/** Return the tags, as links into the list. @returns {Page.Updatable<string[]>} */
export function tagList() {
  const element = h("span", { class: "tags" });
  const update = (/** @type {string[]} */ tags) => refill(element, tags.join(" "), () => tags.map((tag) => h("a", { class: "tag", href: addressOfTag(tag) }, tag)));
  return { element, update };
}

/** Return the address of everything with a tag. @param {string} tag */
export const addressOfTag = (tag) => `#/?${new URLSearchParams({ q: `tag = ${tag}` })}`;

/** Return the tags that somebody typed, separated by spaces or commas. @param {string} text */
export const tagsIn = (text) => [...new Set(text.toLowerCase().split(/[\s,]+/).filter(Boolean))].sort();
