/** Any experiments in one figure, and which of them differ. */

import { h } from "../lib/dom.js";
import { follow } from "../lib/live.js";
import { copyButton } from "../lib/copy.js";
import { empty } from "../lib/states.js";
import { address, chosen } from "./compare/address.js";
import { chooser } from "./compare/chooser.js";
import { controls } from "./compare/controls.js";
import { figure } from "./compare/figure.js";
import { library } from "./compare/library.js";
import { list } from "./compare/list.js";
import { remarks } from "./compare/remarks.js";
import { significance } from "./compare/significance.js";

const ENDED = ["COMPLETED", "FAILED", "CANCELLED"];
const KINDS = ["transferred", "probed", "repetition_completed", "started", "paused", "completed", "failed", "cancelled", "extended"];

/** Fill `root` with the comparison that the address asks for, until `signal`. */
export async function show(root, parameters, signal) {
  const books = library(signal);
  const view = { choice: chosen(parameters), books, signal };
  const parts = [chooser, list, remarks, controls, figure, significance].map((make) => make(view));
  const [search, shown, warned, how, drawn, tested] = parts.map((each) => each.element);
  const results = h("div", { class: "results" }, how, drawn, tested);
  const nothing = empty("Choose experiments above: one, two, or all of a study. The address then holds the comparison, to be shared.");
  const update = (events = []) => {
    const some = view.choice.experiments.some((each) => books.get(each));
    results.hidden = !some;
    nothing.hidden = some || view.choice.experiments.length > 0;
    for (const part of parts) part.update(events);
  };
  view.change = async (changes) => {
    view.choice = { ...view.choice, ...changes };
    history.pushState(null, "", address(view.choice));
    await books.fetch(view.choice.experiments).catch(() => {});  // it is asked for again when the service is back
    if (!signal.aborted) update();
  };
  await arrive(view);
  root.replaceChildren(h("div", { class: "titled" }, h("h1", {}, "Compare"), copyButton("Copy the link", () => location.href)),
    search, shown, warned, results, nothing);
  update();
  const changed = async (events) => {
    const news = events.filter(({ data }) => view.choice.experiments.includes(data.experiment));
    if (events.length && !news.length) return;
    await books.fetch(view.choice.experiments);
    const told = new Set(news.map(({ data }) => data.experiment));
    await books.anew(view.choice.experiments.filter((each) => told.has(each) || !ENDED.includes(books.get(each)?.state)));
    update([...news, null]);
  };
  follow({ kind: KINDS }, changed, signal);
}

/** Look up what the address names; studies in it stand for their experiments. */
async function arrive(view) {
  const { studies, ...choice } = view.choice;
  const of = await Promise.all(studies.map((each) => view.books.study(each)));
  const experiments = [...new Set([...choice.experiments, ...of.flat()])];
  view.choice = { ...choice, experiments };
  if (studies.length) history.replaceState(null, "", address(view.choice));
  await view.books.fetch(experiments);
}
