/** Charts of the service in the page's own look: its ink, its lines, its letters, light or dark. */

import { isDark } from "./theme.js";

/** Colours of lines that are too dark on a dark ground, each as it is there. */
const LIGHTER = {
  "0,114,178": "86,172,230", "213,94,0": "255,140,66", "0,158,115": "64,201,160",
  "204,121,167": "230,160,201", "230,159,0": "242,183,64", "86,180,233": "170,220,250",
};
const PALER = 0.35;
const NARROW_PX = 480;
const PANEL_PX = 270;  // of each, where panels stand one above the other

/** The chart as it is drawn in `canvas`. */
export function dressed({ data, layout: given }, canvas) {
  const narrow = canvas.clientWidth < NARROW_PX;
  const layout = narrow ? stacked(given) : given;
  const style = getComputedStyle(document.documentElement);
  const [ink, line, raised, font] = ["--ink", "--line", "--raised", "--font"].map((each) => style.getPropertyValue(each).trim());
  const least = parseFloat(getComputedStyle(canvas).minHeight) || 0;
  const axis = (each) => ({
    showline: true, linecolor: ink, linewidth: 1, ticks: "outside", ticklen: 4, tickcolor: ink, gridcolor: line, zerolinecolor: line,
    showgrid: layout[each].showgrid ?? each.startsWith("y"), ...layout[each],
    title: { ...layout[each].title, font: { size: narrow ? 12 : 13 } },
  });
  return {
    data: data.map((each) => worn(each, ink)),
    layout: {
      ...layout,
      ...Object.fromEntries(Object.keys(layout).filter((each) => /^[xy]axis\d*$/.test(each)).map((each) => [each, axis(each)])),
      ...(layout.coloraxis && isDark() ? { coloraxis: pale(layout.coloraxis) } : {}),
      annotations: (layout.annotations ?? []).map((each) => (each.name === "ink" ? { ...each, arrowcolor: ink } : each)),
      height: Math.max(layout.height ?? 0, least),
      autosize: true,
      paper_bgcolor: "transparent",
      plot_bgcolor: "transparent",
      font: { family: font, size: narrow ? 12 : 13, color: ink },
      hoverlabel: { bgcolor: raised, bordercolor: line, font: { color: ink, family: font } },
    },
  };
}

/** The panels one above the other, and a bar of colours above them all: for a phone. */
function stacked(layout) {
  const axes = Object.keys(layout).filter((each) => /^xaxis\d*$/.test(each));
  const found = { ...layout };
  if (layout.coloraxis) {
    const { colorbar } = layout.coloraxis;
    const across = { orientation: "h", x: 0, xanchor: "left", y: 1, yanchor: "bottom", len: 1 };
    const titled = { ...colorbar, ...across, title: { ...colorbar.title, side: "top" } };
    Object.assign(found, { coloraxis: { ...layout.coloraxis, colorbar: titled }, margin: { ...layout.margin, t: 64 } });
  }
  if (axes.length < 2 || axes.every((each) => same(layout[each].domain, layout[axes[0]].domain))) return found;
  const gap = 0.24 / axes.length;
  const high = (1 - gap * (axes.length - 1)) / axes.length;
  axes.forEach((x, at) => {
    const y = x.replace("x", "y");
    const top = 1 - at * (high + gap);
    found[x] = { ...layout[x], domain: [0, 1] };
    found[y] = { ...layout[y], domain: [Math.max(0, top - high), top] };
  });
  return { ...found, height: PANEL_PX * axes.length + 120 };
}

const same = (one, other) => String(one) === String(other);

function worn(trace, ink) {
  const own = trace.meta?.ink;
  const color = (each) => (typeof each === "string" ? (own ? ofInk(each, ink) : isDark() ? lighter(each) : each) : each);
  const shown = { ...trace };
  if (trace.line) shown.line = { ...trace.line, color: color(trace.line.color) };
  if (trace.marker) shown.marker = { ...trace.marker, color: color(trace.marker.color) };
  if (trace.fillcolor) shown.fillcolor = color(trace.fillcolor);
  return shown;
}

/** The red, green, blue and opacity of a colour like `#0072B2` or `rgba(0, 114, 178, 0.1)`. */
function parts(color) {
  if (color.startsWith("#")) return [...[1, 3, 5].map((at) => parseInt(color.slice(at, at + 2), 16)), 1];
  const [red, green, blue, opacity = 1] = color.match(/[\d.]+/g)?.map(Number) ?? [];
  return [red, green, blue, opacity];
}

function lighter(color) {
  const [red, green, blue, opacity] = parts(color);
  const found = LIGHTER[`${red},${green},${blue}`];
  return found ? `rgba(${found},${Math.min(1, opacity < 1 ? opacity * 1.4 : 1)})` : color;
}

/** A scale of shades, which may be as dark as the ground, mixed with white. */
function pale(axis) {
  const mixed = (color) => `rgb(${parts(color).slice(0, 3).map((each) => Math.round(each + (255 - each) * PALER))})`;
  return { ...axis, colorscale: axis.colorscale.map(([at, color]) => [at, mixed(color)]) };
}

function ofInk(color, ink) {
  const [red, green, blue] = parts(ink);
  return `rgba(${red},${green},${blue},${parts(color)[3]})`;
}
