/** The experiments that are compared, each with its letter and the way out. */

import { h, refill } from "../../lib/dom.js";
import { pill } from "../../lib/pill.js";

/** The letters A to Z, then AA and so on: short names of the experiments, in their order. */
export function letter(at) {
  const rest = Math.floor(at / 26);
  return (rest ? letter(rest - 1) : "") + String.fromCharCode(65 + (at % 26));
}

/** The list, in the order of the figure's legend. */
export function list(view) {
  const { books } = view;
  const chosen = h("ul", { class: "chosen", "aria-label": "Experiments that are compared" });
  const all = h("button", { type: "button", class: "quiet small", onclick: () => view.change({ experiments: [] }) }, "Remove all");
  const element = h("div", { class: "choice" }, chosen, all);
  const without = async (id) => {
    const at = view.choice.experiments.indexOf(id);
    await view.change({ experiments: view.choice.experiments.filter((each) => each !== id) });
    const buttons = chosen.querySelectorAll("button");
    (buttons[Math.min(at, buttons.length - 1)] ?? document.getElementById("chooser")).focus();
  };
  const item = (id, at) => {
    const found = books.get(id);
    const name = found
      ? h("a", { href: `#/experiments/${id}`, title: books.place(id) }, books.name(id))
      : h("span", { class: "failed" }, books.isMissing(id) ? `There is no experiment ${id}` : id);
    const remove = h("button", { type: "button", class: "link", "aria-label": `Remove ${books.name(id)}`, onclick: () => without(id) }, "✕");
    const place = several(view) && books.place(id) ? h("small", {}, books.place(id)) : null;
    return h("li", {}, h("b", {}, letter(at)), name, place, found ? pill(found.state) : null, remove);
  };
  const update = () => {
    const { experiments } = view.choice;
    element.hidden = !experiments.length;
    all.hidden = experiments.length < 2;
    const key = JSON.stringify(experiments.map((id) => [id, books.get(id)?.state, books.isMissing(id), books.name(id)]));
    refill(chosen, key, () => experiments.map(item));
  };
  return { element, update };
}

const several = ({ books, choice }) => new Set(choice.experiments.map((id) => books.get(id)?.study ?? id)).size > 1;
