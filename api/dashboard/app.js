// @ts-check
/** The page: a bar, and one view at a time, which the address after `#` chooses. */

import { unreachable } from "./lib/api.js";
import { keepSending, linkBench } from "./lib/bench/sender.js";
import { byId, h } from "./lib/dom.js";
import { watchHealth } from "./lib/health.js";
import { empty, failed, loading } from "./lib/placeholders.js";
import { switchTheme } from "./lib/theme.js";

/** @type {[pattern: RegExp, name: string, keys: string[]][]} */
const VIEWS = [
  [/^\/$/, "list", []],
  [/^\/new$/, "new", []],
  [/^\/compare$/, "compare", []],
  [/^\/replay$/, "replay", []],
  [/^\/toy$/, "toy", []],
  [/^\/bench$/, "bench", []],
  [/^\/(?:studies|experiments)\/([\w-]+)$/, "study", ["id"]],
];
const IDS = ["experiment", "request"];
const ID = /^[\w-]*$/;  // dots and slashes would lead to another path of the service

/** @type {Record<string, string[]>} */
const modules = JSON.parse(byId("modules").textContent ?? "{}");

const AWAY = new Set([0, 502, 503, 504]);
const RETRY_MS = 2000;

let leaving = new AbortController();

/** Return the name and the parameters of the view at the address, or null. */
function viewAtAddress() {
  const [path, query] = (location.hash.slice(1) || "/").split("?");
  for (const [pattern, name, keys] of VIEWS) {
    const match = pattern.exec(path);
    if (!match) continue;
    const parameters = new URLSearchParams(query);
    if (IDS.some((key) => !ID.test(parameters.get(key) ?? ""))) return null;
    keys.forEach((key, index) => parameters.set(key, match[index + 1]));
    return { name, parameters };
  }
  return null;
}

/** Show the view of the address, and end what the former view left running. */
async function showView() {
  leaving.abort();
  leaving = new AbortController();
  const { signal } = leaving;
  const root = h("div", { class: "view" }, loading());
  byId("main").replaceChildren(root);
  const view = viewAtAddress();
  for (const link of /** @type {NodeListOf<HTMLElement>} */ (document.querySelectorAll("nav [data-view]"))) {
    if (view && link.dataset.view?.split(" ").includes(view.name)) link.setAttribute("aria-current", "page");
    else link.removeAttribute("aria-current");
  }
  try {
    if (view) {
      const { show } = await loadView(view.name);
      if (!signal.aborted) await show(root, view.parameters, signal);
      linkBench();
    } else showLost(root);
  } catch (error) {
    if (signal.aborted) return;
    root.replaceChildren(failed(error, showView));
    if (AWAY.has(error.status)) retryLater(error.retry ?? showView, signal);
  }
  if (!signal.aborted) document.title = `${root.querySelector("h1")?.textContent ?? "gaplab"} · gaplab`;
}

/** Say that there is no view at the address. @param {HTMLElement} root */
function showLost(root) {
  const home = h("a", { class: "button quiet", href: "#/" }, "To the studies");
  root.replaceChildren(h("h1", {}, "There is no such page"), empty(`There is nothing at ${location.hash}.`, home));
}

/** @param {() => void} retry @param {AbortSignal} signal */
function retryLater(retry, signal) {
  const timer = setTimeout(retry, RETRY_MS);
  signal.addEventListener("abort", () => clearTimeout(timer));
}

/** Load the module of a view. A browser may remember that it failed, so once the service is back the page is loaded again. @param {string} name */
async function loadView(name) {
  preload(name);
  try {
    return await import(`./views/${name}.js`);
  } catch (error) {
    await fetch("livez").catch(() => { throw unreachable(reloadOnceBack); });
    throw error;
  }
}

/** Ask for all modules of a view at once: each level of imports would wait for the level above. @param {string} name */
function preload(name) {
  for (const path of modules[name] ?? []) {
    document.head.append(h("link", { rel: "modulepreload", href: new URL(path, import.meta.url).href }));
  }
  delete modules[name];
}

async function reloadOnceBack() {
  const { signal } = leaving;
  const isBack = await fetch("livez").then((answer) => answer.ok, () => false);
  if (signal.aborted) return;
  if (isBack) location.reload();
  else retryLater(reloadOnceBack, signal);
}

byId("theme").addEventListener("click", switchTheme);
byId("skip").addEventListener("click", (event) => {
  event.preventDefault();  // the address after `#` belongs to the view
  byId("main").focus();
});
addEventListener("hashchange", () => {
  showView().then(() => byId("main").focus({ preventScroll: true }));
});
showView();
watchHealth();
keepSending();
