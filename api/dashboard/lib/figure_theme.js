// @ts-check
/** The service's charts in the colours, lines and letters of the page, light or dark. */

import { isDark } from "./theme.js";

/** Colours of lines that are too dark on a dark ground, each with its replacement there. @type {Record<string, string>} */
const LIGHTER = {
  "0,114,178": "86,172,230", "213,94,0": "255,140,66", "0,158,115": "64,201,160",
  "204,121,167": "230,160,201", "230,159,0": "242,183,64", "86,180,233": "170,220,250",
};
const WHITE_SHARE = 0.35;
const NARROW_PX = 480;
const OPAQUER = 1.4;  // what is half transparent loses its contrast on a dark ground
const WORDS_PX = 100;  // added on a phone for words that stand upright below an axis
const PANEL_PX = 270;  // of each panel, where panels stand one above the other

/** Return a chart as it is drawn in an element. @param {Api.Chart} chart @param {Element} canvas @returns {Api.Chart} */
export function themed({ data, layout: given }, canvas) {
  const isNarrow = canvas.clientWidth < NARROW_PX;
  const layout = isNarrow ? stacked(given) : given;
  const style = getComputedStyle(document.documentElement);
  const [ink, line, raised, font] = ["--ink", "--line", "--raised", "--font"].map((name) => style.getPropertyValue(name).trim());
  const minHeight = parseFloat(getComputedStyle(canvas).minHeight) || 0;
  const axis = (/** @type {string} */ name) => ({
    showline: true, linecolor: ink, linewidth: 1, ticks: "outside", ticklen: 4, tickcolor: ink, gridcolor: line, zerolinecolor: line,
    showgrid: layout[name].showgrid ?? name.startsWith("y"), ...layout[name],
    title: { ...layout[name].title, font: { size: isNarrow ? 12 : 13 } },
  });
  return {
    data: data.map((trace) => themedTrace(trace, ink, Boolean(layout.coloraxis))),
    layout: {
      ...layout,
      ...Object.fromEntries(Object.keys(layout).filter((name) => /^[xy]axis\d*$/.test(name)).map((name) => [name, axis(name)])),
      ...(layout.coloraxis && isDark() ? { coloraxis: paler(layout.coloraxis) } : {}),
      annotations: (layout.annotations ?? []).map((/** @type {any} */ mark) => (mark.name === "ink" ? { ...mark, arrowcolor: ink } : mark)),
      height: Math.max(layout.height ?? 0, minHeight),
      autosize: true,
      paper_bgcolor: "transparent",
      plot_bgcolor: "transparent",
      font: { family: font, size: isNarrow ? 12 : 13, color: ink },
      hoverlabel: { bgcolor: raised, bordercolor: line, font: { color: ink, family: font } },
    },
  };
}

/**
 * Return a layout for a phone: the panels one above the other, a bar of colours above them all, and words below an axis upright.
 * @param {Record<string, any>} layout
 * @returns {Record<string, any>}
 */
export function stacked(layout) {
  const axes = Object.keys(layout).filter((name) => /^xaxis\d*$/.test(name));
  const result = { ...layout };
  if (layout.xaxis?.ticktext) {  // upright where they would overlap: of slanted words Plotly leaves out those that would cross the edge
    Object.assign(result, { xaxis: { ...layout.xaxis, autotickangles: [0, 90] }, height: (layout.height ?? 0) + WORDS_PX });
  }
  if (layout.coloraxis) {
    const { colorbar } = layout.coloraxis;
    const across = { orientation: "h", x: 0, xanchor: "left", y: 1, yanchor: "bottom", len: 1 };
    const titled = { ...colorbar, ...across, title: { ...colorbar.title, side: "top" } };
    Object.assign(result, { coloraxis: { ...layout.coloraxis, colorbar: titled }, margin: { ...layout.margin, t: 64 } });
  }
  if (axes.length < 2 || axes.every((x) => String(layout[x].domain) === String(layout[axes[0]].domain))) return result;
  const gap = 0.24 / axes.length;
  const height = (1 - gap * (axes.length - 1)) / axes.length;
  axes.forEach((x, index) => {
    const y = x.replace("x", "y");
    const top = 1 - index * (height + gap);
    result[x] = { ...result[x], domain: [0, 1] };
    result[y] = { ...layout[y], domain: [Math.max(0, top - height), top] };
  });
  return { ...result, height: PANEL_PX * axes.length + 120 };
}

/** @param {any} trace @param {string} ink @param {boolean} isShaded whether the colours of the figure are shades of a scale */
function themedTrace(trace, ink, isShaded) {
  const color = (/** @type {unknown} */ value) => {
    if (typeof value !== "string") return value;
    if (trace.meta?.ink) return inInk(value, ink);
    return isDark() ? lighter(value, isShaded) : value;
  };
  const result = { ...trace };
  if (trace.line) result.line = { ...trace.line, color: color(trace.line.color) };
  if (trace.marker) result.marker = { ...trace.marker, color: color(trace.marker.color) };
  if (trace.fillcolor) result.fillcolor = color(trace.fillcolor);
  if (isShaded && isDark() && trace.opacity < 1) result.opacity = Math.min(1, trace.opacity * OPAQUER);  // as the bar of colours
  return result;
}

/** Return the red, green, blue and opacity of a colour like `#0072B2` or `rgba(0, 114, 178, 0.1)`. @param {string} color */
export function components(color) {
  if (color.startsWith("#")) return [...[1, 3, 5].map((start) => parseInt(color.slice(start, start + 2), 16)), 1];
  const [red, green, blue, opacity = 1] = color.match(/[\d.]+/g)?.map(Number) ?? [];
  return [red, green, blue, opacity];
}

/**
 * Return the colour of a line on a dark ground.
 * @param {string} color
 * @param {boolean} [isShaded] whether a colour without a replacement is a shade of a scale, which is then mixed with white
 */
export function lighter(color, isShaded = false) {
  const [red, green, blue, opacity] = components(color);
  const replacement = LIGHTER[`${red},${green},${blue}`];
  if (!replacement) return isShaded ? mixed(color) : color;
  return `rgba(${replacement},${Math.min(1, opacity < 1 ? opacity * OPAQUER : 1)})`;
}

/**
 * Return a scale of colours mixed with white, since its dark end could not be seen on a dark ground.
 * @param {{ colorscale: [number, string][] }} axis
 */
function paler(axis) {
  return { ...axis, colorscale: axis.colorscale.map(([position, color]) => [position, mixed(color)]) };
}

/** @param {string} color */
function mixed(color) {
  const [red, green, blue, opacity] = components(color);
  return `rgba(${[red, green, blue].map((value) => Math.round(value + (255 - value) * WHITE_SHARE))},${opacity})`;
}

/** @param {string} color @param {string} ink */
function inInk(color, ink) {
  const [red, green, blue] = components(ink);
  return `rgba(${red},${green},${blue},${components(color)[3]})`;
}
