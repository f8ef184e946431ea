// @ts-check
/** Sections of a view that load when they come into sight, and again after events that change them. */

import { failed, loading } from "./placeholders.js";
import { rest } from "./waiting.js";

const REST_FACTOR = 4;
const RETRY_MS = 1000;

/**
 * @typedef {object} Section
 * @property {HTMLElement} element
 * @property {Set<string> | null} kinds of events that change it; null: all
 * @property {() => Promise<Page.Loaded>} load
 * @property {boolean} isStale
 * @property {boolean} isInSight
 * @property {boolean} isBusy
 * @property {boolean} isFilled
 * @property {number} runs how often it was loaded
 */

/**
 * Return the sections of one view, until `signal`.
 *
 * `add(element, kinds, load)` has `load()` fill the element. `reload(events)` loads the sections that these kinds of events change, or
 * all if there are no events; sections out of sight wait until they come into sight. No section is loaded twice at a time, and each
 * rests four times as long as its loading took. A section is loaded again if `load()` failed after an earlier success, and after a
 * second if the service still computes what it shows.
 *
 * `add` returns a function that loads the section at once, after a choice of the reader. What was being loaded is then out of date:
 * `load()` must drop it.
 * @param {AbortSignal} signal
 * @returns {Page.Sections}
 */
export function sections(signal) {
  /** @type {Map<Element, Section>} */
  const all = new Map();
  const observer = new IntersectionObserver((entries) => {
    for (const { target, isIntersecting } of entries) {
      const section = /** @type {Section} */ (all.get(target));
      section.isInSight = isIntersecting;
      load(section);
    }
  }, { rootMargin: "200px" });
  signal.addEventListener("abort", () => observer.disconnect());

  /** @param {Section} section */
  async function load(section) {
    if (!section.isStale || !section.isInSight || section.isBusy || signal.aborted) return;
    const run = section.runs + 1;
    Object.assign(section, { isBusy: true, isStale: false, runs: run });
    const start = performance.now();
    let isPending = false;
    try {
      const loaded = await section.load();
      if (run !== section.runs) return;
      isPending = loaded === "pending";
      section.isStale ||= isPending || loaded === "failed";
      section.isFilled = true;
    } catch (error) {
      if (run !== section.runs) return;
      section.isStale ||= section.isFilled;
      if (!signal.aborted && !section.isFilled) section.element.replaceChildren(failed(error, () => reload(section), "h3"));
    }
    const restMs = isPending ? 0 : REST_FACTOR * (performance.now() - start);  // the service limits the time that a pending answer takes
    if (section.isFilled) await rest(Math.max(restMs, section.isStale ? RETRY_MS : 0), signal);
    if (run !== section.runs) return;
    section.isBusy = false;
    load(section);
  }

  /** @param {Section} section */
  function reload(section) {
    section.isStale = true;
    load(section);
  }

  return {
    add(element, kinds, loadSection) {
      if (!element.hasChildNodes()) element.append(loading());
      const flags = { isStale: true, isInSight: false, isBusy: false, isFilled: false, runs: 0 };
      const section = { element, kinds: kinds && new Set(kinds), load: loadSection, ...flags };
      all.set(element, section);
      observer.observe(element);
      return () => {
        section.isBusy = false;
        reload(section);
      };
    },
    reload(events) {
      for (const section of all.values()) {
        if (!events.length || !section.kinds || events.some(({ kind }) => section.kinds?.has(kind))) reload(section);
      }
    },
  };
}
