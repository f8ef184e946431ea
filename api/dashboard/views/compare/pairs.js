/** Every pair with every test, and where along the curve it differs. */

import { h } from "../../lib/dom.js";
import { table } from "../../lib/table.js";
import { letter } from "./list.js";
import { spoken } from "./significance.js";
import { probability, size, verdict } from "./verdict.js";

const NAMES = { student: "Student", welch: "Welch", mann_whitney: "Mann–Whitney" };

/** The pairs: a column for each range by the test that is chosen, and the numbers of the last range by all tests. */
export function pairs(view, ids, results, open) {
  const { test, experiments } = view.choice;
  const short = (id) => letter(experiments.indexOf(id));
  const names = view.books.names(experiments);
  const chosen = results.at(-1);
  const order = [...results].sort((one, other) => one.range[0] - other.range[0] || one.range[1] - other.range[1]);
  const columns = ["Pair", ...order.map(({ range }) => `At ${spoken(range)}`), `Difference at ${spoken(chosen.range)}`, "d", "n",
    ...Object.values(NAMES).map((name) => `${name}, p after Holm`)];
  const rows = chosen.pairs.map((pair, at) => [
    `${short(pair.first)} ${names.get(pair.first)} − ${short(pair.second)} ${names.get(pair.second)}`,
    ...order.map((each) => told(each.pairs[at], test)),
    size(pair.difference), size(pair.effect_size), `${pair.n_first}, ${pair.n_second}`,
    ...Object.keys(NAMES).map((each) => probability(pair[each].p_holm)),
  ]);
  return h("details", { open, class: "pairs" }, h("summary", {}, "Every pair, at every range, by every test"), table("Pairs", columns, rows));
}

function told(pair, test) {
  const { kind, sign, words } = verdict(pair, test);
  return h("span", { class: kind }, `${sign} ${words}`, kind === "unknown" ? "" : `, ${probability(pair[test].p_holm)}`);
}
