/** Search as you type over experiments and studies: a combobox, as the ARIA practices have it. */

import { get } from "../../lib/api.js";
import { h } from "../../lib/dom.js";
import { age, count, spoken } from "../../lib/format.js";

const PAUSE_MS = 150;
const STUDIES = 5;
const EXPERIMENTS = 12;
const MOST = 100;  // that the service draws in one figure

/** The field with its list of what was found. */
export function chooser(view) {
  const options = h("ul", { id: "found", role: "listbox", "aria-label": "Found", class: "found", hidden: true });
  const said = h("p", { class: "said", role: "status" });
  const field = h("input", {
    id: "chooser", type: "search", role: "combobox", autocomplete: "off", placeholder: "name or id of an experiment or a study",
    "aria-expanded": "false", "aria-controls": "found", "aria-autocomplete": "list", maxlength: 200,
  });
  let asked = null;
  let timer = null;
  let active = -1;

  const close = () => {
    options.hidden = true;
    activate(-1);
    field.setAttribute("aria-expanded", "false");
  };
  const activate = (at) => {
    active = at;
    [...options.children].forEach((each, index) => each.setAttribute("aria-selected", String(index === at)));
    const now = options.children[at];
    if (now) field.setAttribute("aria-activedescendant", now.id);
    else field.removeAttribute("aria-activedescendant");
    now?.scrollIntoView({ block: "nearest" });
  };
  const take = (ids) => {
    const { experiments } = view.choice;
    const wanted = [...new Set([...experiments, ...ids])];
    said.textContent = wanted.length > MOST ? `${MOST} experiments are shown at most.` : "";
    close();
    field.value = "";
    if (wanted.length > experiments.length) view.change({ experiments: wanted.slice(0, MOST) });
  };
  const look = async () => {
    asked?.abort();
    asked = new AbortController();
    const { signal } = asked;
    try {
      const found = await search(view, field.value.trim(), signal);
      options.replaceChildren(...found.map((each, at) => option(each, at, take)));
      if (!found.length) options.replaceChildren(nothing());
      options.hidden = document.activeElement !== field;
      field.setAttribute("aria-expanded", String(!options.hidden));
      activate(-1);
    } catch (error) {
      if (!signal.aborted) said.textContent = error.message;
    }
  };
  const soon = () => {
    clearTimeout(timer);
    timer = setTimeout(look, PAUSE_MS);
  };
  const keys = (event) => {
    const steps = { ArrowDown: 1, ArrowUp: -1 };
    const many = options.children.length;
    if (event.key === "Escape") close();
    if (event.key in steps) {
      event.preventDefault();
      if (options.hidden) look();
      else activate((active + steps[event.key] + many) % many);
    }
    if (event.key === "Enter" && !options.hidden) options.children[Math.max(active, 0)]?.click();
  };
  field.addEventListener("input", soon);
  field.addEventListener("focus", look);
  field.addEventListener("keydown", keys);
  field.addEventListener("blur", close);
  view.signal.addEventListener("abort", () => { clearTimeout(timer); asked?.abort(); });
  const element = h("div", { class: "chooser" }, h("label", { for: "chooser" }, "Add experiments"), h("div", { class: "combobox" }, field, options), said);
  return { element, update: () => {} };
}

/** The studies and the experiments that have the text in their name or id, the newest first. */
async function search({ books, choice }, text, signal) {
  const [studies, experiments] = await Promise.all([
    get("/studies", { text, limit: STUDIES }, signal), get("/experiments", { text, limit: EXPERIMENTS }, signal)]);
  studies.items.forEach(books.shelve);
  experiments.items.forEach(books.keep);
  const left = experiments.items.filter((each) => !choice.experiments.includes(each.id));
  return [
    ...studies.items.map((each) => ({
      name: each.name, what: `study, all ${count(each.experiments.length)} experiments`, of: each, ids: each.experiments.map(({ id }) => id),
    })),
    ...left.map((each) => ({ name: spoken(each.name), what: books.place(each.id) ?? each.id, of: each, ids: [each.id] })),
  ];
}

const nothing = () =>
  h("li", { class: "none", role: "option", "aria-disabled": "true", id: "found-none" }, "Nothing has that in its name or id.");

function option({ name, what, of, ids }, at, take) {
  return h("li", {
    id: `found-${at}`, role: "option", "aria-selected": "false", onclick: () => take(ids),
    onmousedown: (event) => event.preventDefault(),  // the field keeps the focus
  }, h("span", {}, name), h("small", {}, `${what} · ${of.state.toLowerCase()} · ${age(of.created_at)}`));
}
