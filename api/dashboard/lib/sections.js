/** Parts of a view that are filled when they come into sight, and filled anew when something that they show happened. */

import { failed, loading } from "./states.js";

const REST = 4;
const AGAIN_MS = 1000;

/**
 * The parts of one view. `add(element, kinds, load)` has `load()` fill the element once it can be seen; `tell(events)`
 * has those loaded anew that show one of these events' kinds, or all of them if there are no events: those in sight at
 * once, the others when they come into sight. No part is loaded twice at a time, and each rests four times as long as it took.
 * One whose `load()` says true is not complete yet, and loaded again; so is one that was filled and could not be filled anew.
 */
export function sections(signal) {
  const parts = new Map();
  const sight = new IntersectionObserver((entries) => {
    for (const { target, isIntersecting } of entries) {
      const part = parts.get(target);
      part.seen = isIntersecting;
      go(part);
    }
  }, { rootMargin: "200px" });
  signal.addEventListener("abort", () => sight.disconnect());

  async function go(part) {
    if (!part.stale || !part.seen || part.busy || signal.aborted) return;
    Object.assign(part, { busy: true, stale: false });
    const began = performance.now();
    try {
      part.stale ||= Boolean(await part.load());
      part.filled = true;
    } catch (error) {
      part.stale ||= part.filled;
      if (!signal.aborted && !part.filled) part.element.replaceChildren(failed(error, () => again(part), "h3"));
    }
    if (part.filled) await rest(Math.max(REST * (performance.now() - began), part.stale ? AGAIN_MS : 0), signal);
    part.busy = false;
    go(part);
  }

  function again(part) {
    part.stale = true;
    go(part);
  }

  return {
    add(element, kinds, load) {
      if (!element.hasChildNodes()) element.append(loading());
      parts.set(element, { element, kinds: new Set(kinds), load, stale: true, seen: false, busy: false, filled: false });
      sight.observe(element);
    },
    tell(events) {
      for (const part of parts.values()) {
        if (!events.length || events.some((each) => part.kinds.has(each.kind))) again(part);
      }
    },
  };
}

const rest = (ms, signal) => new Promise((resume) => {
  const timer = setTimeout(resume, ms);
  signal.addEventListener("abort", () => { clearTimeout(timer); resume(); }, { once: true });
});
