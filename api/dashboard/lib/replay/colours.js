/** The colours of a stage, as CSS says them for light and dark. */

const NAMES = ["trunk", "limb", "foot-up", "foot-down", "floor", "floor-other", "sky", "shadow", "trail"];

/** `{ name: [r, g, b, a] }`, each from 0 to 1, of the custom properties `--stage-…` where the element is. */
export function colours(element) {
  const probe = document.createElement("span");
  element.append(probe);
  const found = {};
  for (const name of NAMES) {
    probe.style.color = `var(--stage-${name})`;
    const [r, g, b, a = 1] = getComputedStyle(probe).color.match(/[\d.]+/g).map(Number);
    found[name] = [r / 255, g / 255, b / 255, a];
  }
  probe.remove();
  return found;
}

/** The colour of a shape; a foot's says whether it is on the ground. */
export const colourOf = (shape, all, down) => all[shape.role === "foot" ? (down ? "foot-down" : "foot-up") : shape.role];

/** The same for CSS. */
export const css = ([r, g, b, a]) => `rgb(${255 * r} ${255 * g} ${255 * b} / ${a})`;
