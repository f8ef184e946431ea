/** Every real-world evaluation, page by page, each with the way to its replay. */

import { get, search } from "../../lib/api.js";
import { h } from "../../lib/dom.js";
import { number } from "../../lib/format.js";
import { empty } from "../../lib/states.js";
import { table } from "../../lib/table.js";

const MANY = 25;
const KIND = [["", "samples and probes"], ["sample", "samples, which are learned from"], ["probe", "probes, which are only looked at"]];
const KINDS = ["measured", "probed"];
const COLUMNS = ["Repetition", "Iteration", "What for", "Fitness in reality", "Measured by", "When", "Look"];

/** The table, with what it is limited to above and its pages beneath. */
export function samples(page) {
  const place = h("div");
  const kind = h("select", {}, ...KIND.map(([value, words]) => h("option", { value }, words)));
  const repetition = h("input", { type: "number", min: 0, max: 1000000, step: 1, placeholder: "all", class: "short" });
  let cursors = [null];  // of this page and those before it
  let next = null;
  let asked = 0;
  let turning = false;
  const load = async () => {
    const query = { limit: MANY, cursor: cursors.at(-1), kind: kind.value, repetition: repetition.value };
    const mine = ++asked;
    const found = await get(`/experiments/${page.id}/samples`, query, page.signal);
    if (mine !== asked) return;  // another page has overtaken it
    next = found.next;
    const rows = found.items.map((each) => row(page, each));
    place.replaceChildren(rows.length ? table("Real-world evaluations", COLUMNS, rows) : empty("Nothing was tried in reality yet."));
    back.disabled = cursors.length < 2;
    on.disabled = !next;
    where.textContent = `Page ${cursors.length}`;
  };
  const say = (error) => { where.textContent = error.message; };
  const turn = async (to) => {
    if (turning) return;
    const before = cursors;
    turning = true;
    cursors = to;
    try {
      await load();
    } catch (error) {
      if (cursors === to) cursors = before;
      say(error);
    }
    turning = false;
  };
  const limit = () => {
    cursors = [null];
    load().catch(say);
  };
  const back = h("button", { type: "button", class: "quiet small", disabled: true, onclick: () => turn(cursors.slice(0, -1)) }, "Before");
  const on = h("button", { type: "button", class: "quiet small", disabled: true, onclick: () => turn([...cursors, next]) }, "After");
  const where = h("span", { role: "status" });
  const limited = h("p", { class: "options", onchange: limit },
    h("label", {}, "Show ", kind), h("label", {}, "Repetition ", repetition));
  page.parts.add(place, KINDS, load);
  return [limited, place, h("p", { class: "pages" }, back, where, on)];
}

function row({ id, experiment }, each) {
  const kind = each.kind === "sample" ? "sample" : "transfer";
  const at = { experiment: id, repetition: each.repetition, iteration: each.iteration };
  const toy = experiment.spec.robot?.name === "toy_function";
  const words = `${toy ? "Step" : "Replay"}, repetition ${each.repetition}, iteration ${each.iteration}`;
  const link = h("a", { href: toy ? `#/toy${search(at)}` : `#/replay${search({ ...at, kind })}`, "aria-label": words }, toy ? "Step" : "Replay");
  return [String(each.repetition), String(each.iteration), each.kind, each.fitness === null ? "physics failed" : number(each.fitness),
    each.measured_by, new Date(each.measured_at).toLocaleString(), link];
}
