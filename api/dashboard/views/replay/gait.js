// @ts-check
/** The gait: footfalls, height and speed over time, under a cursor that moves with the replay. */

import { h } from "../../lib/dom.js";
import { figureDownloads } from "../../lib/downloads.js";
import { plot } from "../../lib/plot.js";

/**
 * Return the figure, and `moveCursor(time)`; a click on the figure calls `goTo` with its time.
 *
 * @param {Page.ReplayChoice} choice
 * @param {(time: number) => void} goTo
 * @param {AbortSignal} signal
 */
export function gait(choice, goTo, signal) {
  const cursor = h("div", { class: "cursor", "aria-hidden": "true", hidden: true });
  const place = h("div");
  const frame = h("div", { class: "gait" }, place, cursor);
  let lastTime = 0;
  const canvas = () => /** @type {HTMLElement} */ (place.querySelector(".plot"));
  /** Plotly's layout, whose axis knows where a time is; it has no public name. */
  const layout = () => /** @type {any} */ (place.querySelector(".js-plotly-plot"))?._fullLayout;

  /** @param {number} time */
  function moveCursor(time) {
    lastTime = time;
    const { xaxis: axis, _size: size } = layout() ?? {};
    cursor.hidden = !axis?._length;
    if (cursor.hidden) return;
    const [outer, inner] = [frame.getBoundingClientRect(), canvas().getBoundingClientRect()];
    cursor.style.left = `${inner.left - outer.left + axis._offset + axis.l2p(time)}px`;
    cursor.style.top = `${inner.top - outer.top + size.t}px`;
    cursor.style.height = `${size.h}px`;
  }

  place.addEventListener("click", (event) => {
    const axis = layout()?.xaxis;
    if (axis?._length) goTo(axis.p2l(event.clientX - canvas().getBoundingClientRect().left - axis._offset));
  });
  place.addEventListener("drawn", () => moveCursor(lastTime));
  plot(place, "gait", signal)(choice);
  const downloads = figureDownloads("gait", choice, `gaplab-${choice.experiment}-gait`);
  return { element: h("section", { class: "card" }, h("h2", {}, "Gait"), frame, downloads), moveCursor };
}
