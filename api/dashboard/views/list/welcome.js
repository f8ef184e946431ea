// @ts-check
/** What a list without any study says: what gaplab is, and how to begin. */

import { get, keyed } from "../../lib/api.js";
import { h, tellingErrors } from "../../lib/dom.js";

/** Return what gaplab is, with a button that submits the first of the presets, the toy. */
export function welcome() {
  const failure = h("p", { class: "failed", role: "alert" });
  const submit = keyed("/studies");
  const tryToy = tellingErrors(failure)(async () => {
    const [{ spec }] = await get("/assets/dashboard/presets.json");
    location.hash = `#/studies/${(await submit(spec)).id}`;
  });
  return h("section", { class: "welcome empty" },
    h("h2", {}, "Nothing was submitted yet"),
    h("p", {}, "A controller that was evolved in simulation often fails on the real robot. gaplab narrows this gap: it tunes the simulator from a handful of "
      + "trials in reality, and compares the strategies that choose those trials."),
    h("p", {}, "The toy shows it in ten seconds: reality is a curve with one maximum that nobody has seen, and each strategy may try a few points of it."),
    h("p", { class: "choices" }, h("button", { type: "button", onclick: tryToy }, "Try the toy"), h("a", { class: "button quiet", href: "#/new" }, "Submit a study")),
    failure);
}
