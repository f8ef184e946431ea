/** The page: a bar, and one view at a time, chosen by the address after `#`. */

import { Problem } from "./lib/api.js";
import { h } from "./lib/dom.js";
import { empty, failed, loading } from "./lib/states.js";
import { switchTheme } from "./lib/theme.js";

const VIEWS = [
  [/^\/$/, "list", []],
  [/^\/new$/, "new", []],
  [/^\/compare$/, "compare", []],
  [/^\/replay$/, "replay", []],
  [/^\/toy$/, "toy", []],
  [/^\/studies\/([\w-]+)$/, "study", ["id"]],
  [/^\/experiments\/([\w-]+)$/, "experiment", ["id"]],
];
const ID = /^[\w-]*$/;  // with dots and slashes in it, a path of the service would be another

const AWAY = new Set([0, 502, 503, 504]);
const AGAIN_MS = 2000;

let leaving = new AbortController();

/** What the address asks for: the view's name and its parameters, or nothing. */
function wanted() {
  const [path, query] = (location.hash.slice(1) || "/").split("?");
  for (const [pattern, name, keys] of VIEWS) {
    const found = pattern.exec(path);
    if (!found) continue;
    const parameters = new URLSearchParams(query);
    if (!ID.test(parameters.get("experiment") ?? "")) return null;
    keys.forEach((key, at) => parameters.set(key, found[at + 1]));
    return { name, parameters };
  }
  return null;
}

/** Show the view of the address; what the former one had running ends. */
async function route() {
  leaving.abort();
  leaving = new AbortController();
  const { signal } = leaving;
  const root = h("div", { class: "view" }, loading());
  const main = document.getElementById("main");
  main.replaceChildren(root);
  const view = wanted();
  for (const link of document.querySelectorAll("nav [data-view]")) {
    if (link.dataset.view === view?.name) link.setAttribute("aria-current", "page");
    else link.removeAttribute("aria-current");
  }
  try {
    const { show } = view ? await loaded(view.name) : { show: lost };
    if (!signal.aborted) await show(root, view?.parameters, signal);
  } catch (error) {
    if (signal.aborted) return;
    root.replaceChildren(failed(error, route));
    if (AWAY.has(error.status)) againOnce(error.again ?? route, signal);
  }
  if (!signal.aborted) document.title = `${root.querySelector("h1")?.textContent ?? "gaplab"} · gaplab`;
}

/** There is no view at this address. */
function lost(root) {
  const home = h("a", { class: "button quiet", href: "#/" }, "To the experiments");
  root.replaceChildren(h("h1", {}, "There is no such page"), empty(`Nothing is shown at ${location.hash}.`, home));
}

/** A service that is away is asked again by itself. */
function againOnce(again, signal) {
  const timer = setTimeout(again, AGAIN_MS);
  signal.addEventListener("abort", () => clearTimeout(timer));
}

/** The module of a view. A browser may remember that it could not be had, so once the service is back all begins anew. */
async function loaded(name) {
  try {
    return await import(`./views/${name}.js`);
  } catch (error) {
    await fetch("livez").catch(() => { throw new Problem({ detail: "It may be down, or the network is. What it has stored is safe.", again: anew }); });
    throw error;
  }
}

async function anew() {
  const { signal } = leaving;
  const isBack = await fetch("livez").then((answer) => answer.ok, () => false);
  if (signal.aborted) return;
  if (isBack) location.reload();
  else againOnce(anew, signal);
}

document.getElementById("theme").addEventListener("click", switchTheme);
document.querySelector(".skip").addEventListener("click", (event) => {
  event.preventDefault();  // the address after `#` is the view's
  document.getElementById("main").focus();
});
addEventListener("hashchange", () => {
  route().then(() => document.getElementById("main").focus({ preventScroll: true }));
});
route();
