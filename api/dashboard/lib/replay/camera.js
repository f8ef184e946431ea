// @ts-check
/** A camera that goes round the worlds: by mouse, touch, wheel, or keys. */

const LOWEST = 0.05;
const STEEPEST = 1.5;
const NEAREST_M = 0.4;
const FARTHEST_M = 8;
const STEP = 0.12;

/** @typedef {[turn: number, rise: number, zoom: number]} Move angles in radians, and a factor of the distance */

/** @type {Record<string, Move>} */
const KEYS = { ArrowLeft: [-STEP, 0, 1], ArrowRight: [STEP, 0, 1], ArrowUp: [0, STEP, 1], ArrowDown: [0, -STEP, 1], "+": [0, 0, 0.9], "-": [0, 0, 1.1] };

/** @typedef {ReturnType<typeof camera>} Camera */

/**
 * Return a camera; `changed` is called after each move.
 *
 * @param {() => void} changed
 * @param {number} [scale] the size of what it sees, relative to the quadruped
 */
export function camera(changed, scale = 1) {
  const position = { turn: -1.0, rise: 0.35, distance: 1.25 };

  /** @type {(turn: number, rise: number, zoom?: number) => void} */
  function move(turn, rise, zoom = 1) {
    position.turn += turn;
    position.rise = Math.min(Math.max(position.rise + rise, LOWEST), STEEPEST);
    position.distance = Math.min(Math.max(position.distance * zoom, NEAREST_M), FARTHEST_M);
    changed();
  }

  /**
   * Let a canvas move the camera, until `signal`.
   *
   * @param {HTMLCanvasElement} canvas
   * @param {AbortSignal} signal
   */
  function listen(canvas, signal) {
    /** @type {Map<number, PointerEvent>} */
    const pointers = new Map();
    canvas.addEventListener("pointerdown", (event) => {
      pointers.set(event.pointerId, event);
      canvas.setPointerCapture(event.pointerId);
    }, { signal });
    canvas.addEventListener("pointermove", (event) => {
      const before = pointers.get(event.pointerId);
      if (!before) return;
      if (pointers.size === 1) move(-(event.clientX - before.clientX) / 150, (event.clientY - before.clientY) / 150);
      else pinch([...pointers.values()], before, event);
      pointers.set(event.pointerId, event);
    }, { signal });
    canvas.addEventListener("pointerup", (event) => pointers.delete(event.pointerId), { signal });
    canvas.addEventListener("pointercancel", (event) => pointers.delete(event.pointerId), { signal });
    canvas.addEventListener("wheel", (event) => {
      if (!event.ctrlKey && document.activeElement !== canvas) return;  // the page scrolls, unless the canvas has the focus
      event.preventDefault();
      move(0, 0, Math.exp(event.deltaY / 800));
    }, { signal, passive: false });
    canvas.addEventListener("keydown", (event) => {
      if (!(event.key in KEYS)) return;
      event.preventDefault();
      event.stopPropagation();
      move(...KEYS[event.key]);
    }, { signal });
  }

  /** @type {(pointers: PointerEvent[], before: PointerEvent, event: PointerEvent) => void} */
  function pinch(pointers, before, event) {
    const other = pointers.find(({ pointerId }) => pointerId !== event.pointerId) ?? before;
    const gap = (/** @type {PointerEvent} */ pointer) => Math.hypot(pointer.clientX - other.clientX, pointer.clientY - other.clientY) || 1;
    move(0, 0, gap(before) / gap(event));
  }

  /**
   * Return where the camera is while it looks at a point from `further` metres farther away than its own distance.
   *
   * @param {Page.Vector} target
   * @param {number} [further]
   * @param {number} [slope] angle by which the ground, the plane z = 0, rises along x in the picture
   * @returns {Page.Viewpoint}
   */
  function viewpoint(target, further = 0, slope = 0) {
    const distance = position.distance * scale + further;
    const level = distance * Math.cos(position.rise);
    const eye = [
      target[0] + level * Math.cos(position.turn), target[1] + level * Math.sin(position.turn), target[2] + distance * Math.sin(position.rise)];
    return { eye, target, distance, scale, up: [Math.sin(slope), 0, Math.cos(slope)] };
  }

  return { listen, move, viewpoint };
}
