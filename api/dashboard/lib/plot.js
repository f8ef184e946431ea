// @ts-check
/** Figures: defined by the service, and drawn here by Plotly in the colours of the page. */

import { get } from "./api.js";
import { h } from "./dom.js";
import { themed } from "./figure_theme.js";
import { empty, failed, loading } from "./placeholders.js";
import { table } from "./table.js";
import { onTheme } from "./theme.js";

/** @type {Promise<NonNullable<typeof Plotly>> | null} */
let library = null;

/** Return Plotly, which is loaded for the first figure; if that fails, with the next one. */
function plotly() {
  library ??= new Promise((resolve, reject) => {
    const src = `assets/plotly/plotly-basic.min.js?v=${document.documentElement.dataset.plotly}`;
    const fail = () => {
      library = null;
      reject(new Error("The library that draws figures could not be loaded."));
    };
    document.head.append(h("script", { src, onload: () => (globalThis.Plotly ? resolve(globalThis.Plotly) : fail()), onerror: fail }));
  });
  return library;
}

/**
 * Prepare the figure `/figures/{kind}` for an element, with its caption and its description for screen readers.
 *
 * Returns a function that draws it for a query. That function resolves to false if the figure could not be updated and an earlier
 * answer to the same query still stands. After each drawing the element dispatches the event `drawn`, for what stands over the figure.
 * @param {HTMLElement} element
 * @param {string} kind
 * @param {AbortSignal} signal
 */
export function plot(element, kind, signal) {
  const canvas = h("div", { class: "plot" }, loading());
  const caption = h("figcaption");
  const numbers = h("div");
  const figure = h("figure", {}, canvas, caption, numbers);
  /** @type {Api.FigureRead | null} */
  let answer = null;
  let isDrawn = false;
  let drawnQuery = "";
  let requests = 0;
  const replaceDrawing = (/** @type {HTMLElement} */ words) => {
    isDrawn = false;
    globalThis.Plotly?.purge(canvas);
    for (const name of ["role", "aria-label"]) canvas.removeAttribute(name);
    canvas.style.height = "";
    canvas.replaceChildren(words);
  };
  const drawNow = async () => {
    if (!answer || signal.aborted) return;
    if (answer.empty) {
      replaceDrawing(empty("Nothing to draw yet."));
      return;
    }
    const Plotly = await plotly();
    if (signal.aborted) return;
    canvas.querySelector(".state")?.remove();
    canvas.setAttribute("role", "img");
    canvas.setAttribute("aria-label", answer.alt);
    const { data, layout } = themed(answer.figure, canvas);
    canvas.style.height = layout.height ? `${layout.height}px` : "";
    await Plotly.react(canvas, data, layout, { displayModeBar: false });
    isDrawn = true;
    canvas.dispatchEvent(new Event("drawn", { bubbles: true }));
  };
  let drawing = Promise.resolve();
  /** Draw after what is being drawn: of two drawings at once Plotly may keep the size of the one that began first. */
  const redraw = () => {
    drawing = drawing.catch(() => {}).then(drawNow);
    return drawing;
  };
  /** @type {(query: Page.Query) => Promise<boolean>} */
  const draw = async (query) => {
    const request = ++requests;
    const key = JSON.stringify(query);
    plotly().catch(() => {});  // while the service computes the figure; an error shows when the figure is drawn
    if (element.firstChild !== figure) element.replaceChildren(figure);
    try {
      const newAnswer = await get(`/figures/${kind}`, { ...query, format: "json" }, signal);
      if (request !== requests) return true;  // a later query has replaced this one
      answer = /** @type {Api.FigureRead} */ (newAnswer);
      drawnQuery = key;
      caption.textContent = answer.caption;
      numbers.replaceChildren(...(answer.table && !answer.empty ? [numbersTable(answer.table, numbers.querySelector("details")?.open)] : []));
      await redraw();
      return true;
    } catch (error) {
      if (signal.aborted || request !== requests) return true;
      if (isDrawn && drawnQuery === key) return false;
      answer = null;  // nothing draws the former figure again
      caption.textContent = "";
      numbers.replaceChildren();
      replaceDrawing(failed(error, () => draw(query), "h3"));
      return true;
    }
  };
  onTheme(redraw, signal);
  let width = 0;
  const sizes = new ResizeObserver(() => {  // Plotly's own observer misses a change of size while it draws
    if (canvas.clientWidth === width) return;
    width = canvas.clientWidth;
    redraw().catch(() => {});
  });
  sizes.observe(canvas);
  signal.addEventListener("abort", () => {
    sizes.disconnect();
    globalThis.Plotly?.purge(canvas);
  });
  return draw;
}

/** @param {Api.TableRead} numbers @param {boolean | undefined} open */
function numbersTable({ head, rows }, open) {
  return h("details", { class: "numbers", open }, h("summary", {}, "The numbers"), table("The numbers of the figure", head, rows));
}
