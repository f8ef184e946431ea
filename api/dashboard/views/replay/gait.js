/** The gait: footfalls, height and speed over time, under a cursor that goes with the replay. */

import { h } from "../../lib/dom.js";
import { figureFiles } from "../../lib/downloads.js";
import { plot } from "../../lib/plot.js";

/** The figure as `element`, whose `cursor(time)` is where the replay is; a click goes `to` a time. */
export function gait(asked, replay, to, signal) {
  const line = h("div", { class: "cursor", "aria-hidden": "true", hidden: true });
  const place = h("div");
  const framed = h("div", { class: "gait" }, place, line);
  let now = 0;
  const layout = () => place.querySelector(".js-plotly-plot")?._fullLayout;

  function cursor(time) {
    now = time;
    const { xaxis: x, _size: size } = layout() ?? {};
    const drawn = place.querySelector(".plot");
    line.hidden = !x?._length;
    if (line.hidden) return;
    const [frame, canvas] = [framed.getBoundingClientRect(), drawn.getBoundingClientRect()];
    line.style.left = `${canvas.left - frame.left + x._offset + x.l2p(time)}px`;
    line.style.top = `${canvas.top - frame.top + size.t}px`;
    line.style.height = `${size.h}px`;
  }

  place.addEventListener("click", (event) => {
    const x = layout()?.xaxis;
    if (x?._length) to(x.p2l(event.clientX - place.querySelector(".plot").getBoundingClientRect().left - x._offset));
  });
  place.addEventListener("painted", () => cursor(now));
  plot(place, "gait", asked, signal);
  return { element: h("section", { class: "card" }, h("h2", {}, "Gait"), framed, figureFiles("gait", asked, `gaplab-${asked.experiment}-gait`)), cursor };
}
