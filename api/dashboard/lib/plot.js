/** Figures: defined by the service, drawn here by Plotly in the page's own colours. */

import { get } from "./api.js";
import { h } from "./dom.js";
import { dressed } from "./look.js";
import { empty, failed, loading } from "./states.js";
import { table } from "./table.js";
import { onTheme } from "./theme.js";

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
 * Returns a function that draws it anew, with another query if one is given, and says whether it is as of now; its `drawn` is when it was
 * drawn at first. After each painting the event `painted` rises from it, for what stands over the figure.
 */
export function plot(element, kind, query, signal) {
  const canvas = h("div", { class: "plot" });
  const caption = h("figcaption");
  const numbers = h("div");
  canvas.append(loading());
  plotly().catch(() => {});  // while the service computes the figure; what is wrong is said when it is drawn
  element.replaceChildren(h("figure", {}, canvas, caption, numbers));
  let answer = null;
  let drawn = false;
  let shown = null;  // the query of what is drawn
  let asked = 0;
  const say = (words) => {
    drawn = false;
    globalThis.Plotly?.purge(canvas);
    for (const each of ["role", "aria-label"]) canvas.removeAttribute(each);
    canvas.style.height = "";
    canvas.replaceChildren(words);
  };
  const paint = async () => {
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
    const { data, layout } = dressed(answer.figure, canvas);
    canvas.style.height = layout.height ? `${layout.height}px` : "";
    await library.react(canvas, data, layout, { displayModeBar: false });
    drawn = true;
    canvas.dispatchEvent(new Event("painted", { bubbles: true }));
  };
  let painting = Promise.resolve();
  /** One after the other: of two at once Plotly may keep the size of the one that began first. */
  const draw = () => {
    painting = painting.catch(() => {}).then(paint);
    return painting;
  };
  const refresh = async (changed = query) => {
    query = changed;
    const mine = ++asked;
    const wanted = JSON.stringify(query);
    try {
      const found = await get(`/figures/${kind}`, { ...query, format: "json" }, signal);
      if (mine !== asked) return true;  // another query has overtaken it
      answer = found;
      shown = wanted;
      caption.textContent = answer.caption;
      numbers.replaceChildren(...(answer.table && !answer.empty ? [counted(answer.table, numbers.querySelector("details")?.open)] : []));
      await draw();
      return true;
    } catch (error) {
      if (signal.aborted || mine !== asked) return true;
      if (drawn && shown === wanted) return false;  // it stays as it was
      say(failed(error, () => refresh(), "h3"));
      return true;
    }
  };
  onTheme(draw, signal);
  let width = 0;
  const watch = new ResizeObserver(() => {  // also of a change while it is drawn, which Plotly's own watch misses
    if (canvas.clientWidth === width) return;
    width = canvas.clientWidth;
    draw().catch(() => {});
  });
  watch.observe(canvas);
  signal.addEventListener("abort", () => {
    watch.disconnect();
    globalThis.Plotly?.purge(canvas);
  });
  return Object.assign(refresh, { drawn: refresh() });
}

function counted({ head, rows }, open) {
  return h("details", { class: "numbers", open }, h("summary", {}, "The numbers"), table("The numbers of the figure", head, rows));
}
