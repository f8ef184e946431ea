/** Which pairs differ, and at which numbers of real-world evaluations. */

import { get } from "../../lib/api.js";
import { h } from "../../lib/dom.js";
import { failed, loading } from "../../lib/states.js";
import { TESTS, whole } from "./address.js";
import { matrix } from "./matrix.js";
import { pairs } from "./pairs.js";

const MOST = 20;  // experiments in one table: 190 pairs
const NOTE = "p after Holm’s correction over all pairs; a pair differs where it is below 0.05, and is not significantly different " +
  "(n. s.) elsewhere. d is Cohen’s effect size. Values of one repetition at several counts depend on each other, so p over a " +
  "range is smaller than it should be: it is as in the paper, and safe at a single count only.";

/** The tests over a range that is chosen, as a matrix, and over the paper's ranges, pair by pair. */
export function significance(view) {
  const buttons = h("div", { class: "ranges", role: "group", "aria-label": "Range of real-world evaluations" });
  const from = h("input", { type: "number", min: 0, max: 1000, step: 1, class: "short" });
  const to = h("input", { type: "number", min: 0, max: 1000, step: 1, class: "short" });
  const tests = Object.entries(TESTS).map(([value, words]) => h("option", { value }, words));
  const test = h("select", { onchange: () => view.change({ test: test.value }) }, ...tests);
  const typed = () => view.change({ from: whole(from.value), to: whole(to.value) });
  from.addEventListener("change", typed);
  to.addEventListener("change", typed);
  const place = h("div");
  const element = h("section", { class: "card significance", "aria-labelledby": "differ" },
    h("div", { class: "titled" }, h("h2", { id: "differ" }, "Which differ"), h("p", { class: "options" }, h("label", {}, "Test ", test))),
    h("div", { class: "controls" }, buttons, h("label", {}, "from ", from), h("label", {}, "to ", to)), place, h("p", { class: "note" }, NOTE));
  let key = null;
  let turn = 0;
  const update = (events) => {
    const ids = view.choice.experiments.filter((each) => view.books.get(each));
    element.hidden = ids.length < 2;
    if (ids.length < 2) return;
    const last = Math.max(1, ...ids.map((each) => lastOf(view.books.get(each))));
    const range = [view.choice.from ?? 1, view.choice.to ?? last];
    test.value = view.choice.test;
    if (document.activeElement !== from) from.value = range[0];
    if (document.activeElement !== to) to.value = range[1];
    buttons.replaceChildren(...ranges(last).map((each) => button(each, range, view)));
    const now = JSON.stringify([ids, range, view.choice.test]);
    if (key === now && !events.length) return;
    const anew = key !== now;
    key = now;
    const mine = ++turn;
    fill(place, view, { ids, range, last, anew }, () => mine === turn);
  };
  return { element, update };
}

/** The last count that the experiment can have; the baseline has none. */
const lastOf = ({ strategy, spec }) => (strategy === "direct" ? 0 : spec.iterations);

/** The paper's ranges, as far as these experiments go. */
export const ranges = (last) => [[1, 1], [3, last], [6, last], ...(last > 1 ? [[1, last]] : [])].filter(([from]) => from <= last);

/** A range in words. */
export const spoken = ([from, to]) => (from === to ? `${from}` : `${from}–${to}`);

function button(range, now, view) {
  const pressed = spoken(range) === spoken(now);
  const [from, to] = range;
  const press = () => view.change({ from, to });
  const words = from === to ? `at ${from}` : spoken(range);
  return h("button", { type: "button", class: "quiet small", "aria-pressed": String(pressed), onclick: press }, words);
}

async function fill(place, view, { ids, range, last, anew }, wanted) {
  if (ids.length > MOST) {
    place.replaceChildren(h("p", {}, `Pairs are tested for up to ${MOST} experiments; these are ${ids.length}.`));
    return;
  }
  if (anew && !place.hasChildNodes()) place.replaceChildren(loading());
  const asked = [...ranges(last).filter((each) => spoken(each) !== spoken(range)), range];
  try {
    const found = await Promise.all(asked.map(([from, to]) => get("/comparisons", { experiment: ids, from, to }, view.signal)));
    if (!wanted()) return;
    const results = asked.map((each, at) => ({ range: each, pairs: found[at] }));
    const open = place.querySelector("details")?.open ?? false;
    place.replaceChildren(...matrix(view, ids, results.at(-1)), pairs(view, ids, results, open));
  } catch (error) {
    const kept = !anew && place.querySelector("table");  // as of before, until the service is back
    if (wanted() && !kept && !view.signal.aborted) place.replaceChildren(failed(error, () => fill(place, view, { ids, range, last, anew }, wanted), "h3"));
  }
}
