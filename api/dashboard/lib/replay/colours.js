// @ts-check
/** The colours of a stage, from CSS, for light and dark. */

const NAMES = ["trunk", "limb", "foot-up", "foot-down", "floor", "floor-other", "sky", "shadow", "trail"];

/**
 * Return the colours of the custom properties `--stage-…`; red, green, blue and opacity go from 0 to 1.
 *
 * @returns {Page.Palette}
 */
export function colours() {
  const probe = document.createElement("span");
  document.body.append(probe);
  const palette = Object.fromEntries(NAMES.map((name) => {
    probe.style.color = `var(--stage-${name})`;
    return [name, components(getComputedStyle(probe).color)];
  }));
  probe.remove();
  return palette;
}

/**
 * Return the components of `rgb(…)` or `rgba(…)`.
 *
 * @param {string} color
 * @returns {Page.Colour}
 */
export function components(color) {
  const [red, green, blue, opacity = 1] = (color.match(/[\d.]+/g) ?? []).map(Number);
  return [red / 255, green / 255, blue / 255, opacity];
}

/**
 * Return the colour of a shape; a foot has another one while it is on the ground.
 *
 * @param {Api.Shape} shape
 * @param {Page.Palette} palette
 * @param {boolean} isGrounded
 */
export const colourOf = (shape, palette, isGrounded) => palette[shape.role === "foot" ? (isGrounded ? "foot-down" : "foot-up") : shape.role];

/**
 * Return a colour as CSS.
 *
 * @param {Page.Colour} colour
 */
export const css = ([red, green, blue, opacity]) => `rgb(${255 * red} ${255 * green} ${255 * blue} / ${opacity})`;
