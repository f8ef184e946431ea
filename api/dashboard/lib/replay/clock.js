// @ts-check
/** The time of a replay: it runs, stops, is moved by hand, and starts over at the end. */

/**
 * @typedef {object} Listeners
 * @property {(time: number) => void} changed called at each change of the time
 * @property {(isPlaying: boolean) => void} toggled called when the clock starts or stops
 * @property {AbortSignal} signal
 */

/** @typedef {ReturnType<typeof clock>} Clock */

/**
 * Return a clock from 0 to `lengthS` seconds.
 *
 * @param {number} lengthS
 * @param {Listeners} listeners
 */
export function clock(lengthS, { changed, toggled, signal }) {
  let time = 0;
  let speed = 1;
  let isPlaying = false;
  /** @type {number | null} */
  let lastFrame = null;
  /** @type {(() => void) | null} told when it stops, while it plays once */
  let stopped = null;

  /** @param {number} now */
  function tick(now) {
    if (!isPlaying || signal.aborted) return;
    if (lastFrame !== null) time += (speed * (now - lastFrame)) / 1000;
    lastFrame = now;
    if (time > lengthS) time = stopped ? lengthS : time % lengthS;
    changed(time);
    if (stopped && time === lengthS) play(false);
    else requestAnimationFrame(tick);
  }

  function play(on = !isPlaying) {
    if (on === isPlaying) return;
    isPlaying = on;
    lastFrame = null;
    if (on && time >= lengthS) time = 0;
    toggled(on);
    if (on) requestAnimationFrame(tick);
    else {
      stopped?.();
      stopped = null;
    }
  }

  return {
    play,
    get time() { return time; },
    /** @param {number} newTime */
    goTo(newTime) {
      time = Math.min(Math.max(newTime, 0), lengthS);
      changed(time);
    },
    /** @param {() => void} whenStopped called at the end, or when it is stopped before */
    playOnce(whenStopped) {
      play(false);
      time = 0;
      changed(time);
      stopped = whenStopped;
      play(true);
    },
    /** @param {number} newSpeed 1 is as fast as the world */
    setSpeed(newSpeed) { speed = newSpeed; },
  };
}
