/** A camera that goes round what it looks at: by mouse, touch, wheel, or keys. */

const STEEPEST = 1.5;
const LOWEST = 0.05;
const STEP = 0.12;
const KEYS = { ArrowLeft: [-STEP, 0, 1], ArrowRight: [STEP, 0, 1], ArrowUp: [0, STEP, 1], ArrowDown: [0, -STEP, 1], "+": [0, 0, 0.9], "-": [0, 0, 1.1] };

/** The camera; `changed` is called when somebody moved it. */
export function camera(changed) {
  const at = { turn: -1.0, rise: 0.35, distance: 1.25 };

  function go(turn, rise, nearer = 1) {
    at.turn += turn;
    at.rise = Math.min(Math.max(at.rise + rise, LOWEST), STEEPEST);
    at.distance = Math.min(Math.max(at.distance * nearer, 0.4), 8);
    changed();
  }

  /** Let the canvas move the camera. */
  function follow(canvas, signal) {
    const held = new Map();
    const on = (kind, handler, options = {}) => canvas.addEventListener(kind, handler, { signal, ...options });
    on("pointerdown", (event) => {
      held.set(event.pointerId, event);
      canvas.setPointerCapture(event.pointerId);
    });
    on("pointermove", (event) => {
      const before = held.get(event.pointerId);
      if (!before) return;
      if (held.size === 1) go(-(event.clientX - before.clientX) / 150, (event.clientY - before.clientY) / 150);
      else pinch(held, before, event);
      held.set(event.pointerId, event);
    });
    for (const kind of ["pointerup", "pointercancel"]) on(kind, (event) => held.delete(event.pointerId));
    on("wheel", (event) => {
      if (!event.ctrlKey && document.activeElement !== canvas) return;  // the page scrolls, unless one is at the camera
      event.preventDefault();
      go(0, 0, Math.exp(event.deltaY / 800));
    }, { passive: false });
    on("keydown", (event) => {
      const step = KEYS[event.key];
      if (!step) return;
      event.preventDefault();
      event.stopPropagation();
      go(...step);
    });
  }

  function pinch(held, before, event) {
    const other = [...held.values()].find((each) => each.pointerId !== event.pointerId);
    const far = (one) => Math.hypot(one.clientX - other.clientX, one.clientY - other.clientY) || 1;
    go(0, 0, far(before) / far(event));
  }

  /** Where it is and what it looks at, so far from a point. */
  function of(target, further = 0) {
    const distance = at.distance + further;
    const level = distance * Math.cos(at.rise);
    const eye = [target[0] + level * Math.cos(at.turn), target[1] + level * Math.sin(at.turn), target[2] + distance * Math.sin(at.rise)];
    return { eye, target, distance };
  }

  return { follow, of };
}
