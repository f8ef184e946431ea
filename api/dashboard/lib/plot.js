/** Figures: defined by the service, drawn here by Plotly in the page's own colours. */

import { get } from "./api.js";
import { h } from "./dom.js";
import { empty, failed, loading } from "./states.js";
import { isDark, onTheme } from "./theme.js";

let loaded = null;

/** Plotly, fetched when the first figure is drawn; if that fails, with the next one. */
function plotly() {
  loaded ??= new Promise((resolve, reject) => {
    const src = `assets/plotly/plotly.min.js?v=${document.documentElement.dataset.plotly}`;
    const fail = () => {
      loaded = null;
      reject(new Error("What draws figures could not be loaded."));
    };
    document.head.append(h("script", { src, onload: () => resolve(globalThis.Plotly), onerror: fail }));
  });
  return loaded;
}

/**
 * Draw `/figures/{kind}` into `element`, with its caption and its words for those who do not see it.
 * Returns a function that draws it anew, with another query if one is given.
 */
export function plot(element, kind, query, signal) {
  const canvas = h("div", { class: "plot" });
  const caption = h("figcaption");
  canvas.append(loading());
  element.replaceChildren(h("figure", {}, canvas, caption));
  let answer = null;
  const say = (words) => {
    globalThis.Plotly?.purge(canvas);
    for (const each of ["role", "aria-label"]) canvas.removeAttribute(each);
    canvas.replaceChildren(words);
  };
  const draw = async () => {
    if (!answer || signal.aborted) return;
    if (answer.empty) {
      say(empty("Nothing to draw yet."));
      return;
    }
    const library = await plotly();
    if (signal.aborted) return;
    canvas.querySelector(".state")?.remove();
    canvas.setAttribute("role", "img");
    canvas.setAttribute("aria-label", answer.alt);
    const { data, layout } = themed(answer.figure);
    await library.react(canvas, data, layout, { displayModeBar: false, responsive: true });
  };
  const refresh = async (changed = query) => {
    query = changed;
    try {
      answer = await get(`/figures/${kind}`, { ...query, format: "json" }, signal);
      caption.textContent = answer.caption;
      await draw();
    } catch (error) {
      if (!signal.aborted && !answer) say(failed(error, () => refresh()));
    }
  };
  onTheme(draw, signal);
  signal.addEventListener("abort", () => globalThis.Plotly?.purge(canvas));
  refresh();
  return refresh;
}

/** The figure in the colours of the page: its ink, its ground, its lines. */
function themed({ data, layout }) {
  const style = getComputedStyle(document.documentElement);
  const [ink, line] = ["--ink", "--line"].map((each) => style.getPropertyValue(each).trim());
  const axes = Object.keys(layout).filter((each) => /^[xy]axis\d*$/.test(each));
  const lined = Object.fromEntries(axes.map((each) => [each, { ...layout[each], gridcolor: line, linecolor: ink, zerolinecolor: line }]));
  return {
    data: data.map((each) => (each.meta?.ink && isDark() ? inked(each, ink) : each)),
    layout: { ...layout, ...lined, paper_bgcolor: "transparent", plot_bgcolor: "transparent", font: { ...layout.font, color: ink } },
  };
}

function inked(trace, ink) {
  const shown = { ...trace };
  if (trace.line) shown.line = { ...trace.line, color: ink };
  if (trace.marker) shown.marker = { ...trace.marker, color: ink };
  return shown;
}
