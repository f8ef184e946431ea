// @ts-check
/** A replay as a video: both worlds side by side, which the browser encodes while they play. */

import { h } from "../../lib/dom.js";
import { save } from "../../lib/downloads.js";

const KINDS = ["video/mp4;codecs=avc1.640028", "video/webm;codecs=vp9", "video/webm"];
const BITS_PER_S = 8_000_000;
const BAR = 0.06;  // height of a line of words, as a share of the height of a world
const LAST_MS = 300;  // the last frame stays so long

/**
 * Return a button that plays the replay once, at the speed that is chosen, and saves what is seen; and `take(time)`, which
 * must be called in the same task as the canvases are drawn.
 *
 * @param {HTMLCanvasElement[]} canvases of the worlds
 * @param {string} name of the file, without its ending
 * @param {(whenStopped: () => void) => void} playOnce
 * @param {AbortSignal} signal
 */
export function recording(canvases, name, playOnce, signal) {
  const kind = KINDS.find((each) => globalThis.MediaRecorder?.isTypeSupported(each));
  const status = h("span", { role: "status", class: "note" }, kind ? "" : " This browser records no videos.");
  const button = h("button", { type: "button", class: "quiet small", disabled: !kind, onclick: record }, "Record a video");
  /** @type {((time: number) => void) | null} */
  let running = null;

  function record() {
    const { canvas, paint } = film(canvases);
    /** @type {MediaRecorder | null} */
    let recorder = null;
    running = (time) => {
      paint(time);
      recorder ??= started(canvas);  // of a canvas with the worlds, so that no frame is empty
    };
    const end = () => { if (recorder?.state === "recording") recorder.stop(); };
    button.disabled = true;
    status.textContent = " Recording…";
    playOnce(() => setTimeout(end, LAST_MS));
    signal.addEventListener("abort", end, { once: true });
  }

  /** @param {HTMLCanvasElement} canvas */
  function started(canvas) {
    const recorder = new MediaRecorder(canvas.captureStream(), { mimeType: kind, videoBitsPerSecond: BITS_PER_S });
    /** @type {Blob[]} */
    const pieces = [];
    recorder.ondataavailable = ({ data }) => pieces.push(data);
    recorder.onstop = () => {
      running = null;
      button.disabled = false;
      status.textContent = "";
      if (!signal.aborted) save(new Blob(pieces, { type: recorder.mimeType }), `${name}.${recorder.mimeType.includes("mp4") ? "mp4" : "webm"}`);
    };
    recorder.start();
    return recorder;
  }

  return {
    element: h("p", { class: "files" }, button, status),
    take: (/** @type {number} */ time) => running?.(time),
  };
}

/**
 * Return a canvas with the worlds side by side, each below what it is, and `paint(time)`.
 *
 * @param {HTMLCanvasElement[]} canvases
 */
function film(canvases) {
  const even = (/** @type {number} */ size) => 2 * Math.round(size / 2);  // as encoders want it
  const [width, height] = [even(canvases[0].width), even(canvases[0].height)];
  const bar = even(BAR * height);
  const canvas = h("canvas", { width: width * canvases.length, height: height + 2 * bar });
  const pen = /** @type {CanvasRenderingContext2D} */ (canvas.getContext("2d"));
  const { color, backgroundColor } = getComputedStyle(document.body);
  /** @type {(words: string, left: number, top: number) => void} */
  const write = (words, left, top) => pen.fillText(words, left + bar / 2, top + bar / 2, width - bar);
  const paint = (/** @type {number} */ time) => {
    pen.fillStyle = backgroundColor;
    pen.fillRect(0, 0, canvas.width, canvas.height);
    pen.fillStyle = color;
    pen.font = `${0.7 * bar}px system-ui, sans-serif`;
    pen.textBaseline = "middle";
    canvases.forEach((world, place) => {
      write(world.getAttribute("aria-label") ?? "", place * width, 0);
      pen.drawImage(world, place * width, bar, width, height);
    });
    write(`${time.toFixed(2)} s`, 0, bar + height);
  };
  return { canvas, paint };
}
