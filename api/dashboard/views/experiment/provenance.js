/** Under what an experiment was computed. */

import { get, post } from "../../lib/api.js";
import { ask } from "../../lib/dialog.js";
import { h } from "../../lib/dom.js";
import { empty } from "../../lib/states.js";
import { framed } from "../../lib/table.js";

const KINDS = ["repetition_claimed", "versions_refused", "versions_accepted", "completed"];

/** Each software and machine that had part in it. */
export function provenance(page) {
  const place = h("div");
  page.parts.add(place, KINDS, async () => {
    const { computed_with: bound, refused_by: other, uses } = await get(`/experiments/${page.id}/provenance`, {}, page.signal);
    place.replaceChildren(...(other ? [refused(page, bound, other)] : []),
      ...(uses.length ? uses.map(use) : [empty("No supervisor of this service has computed any of it.")]));
  });
  return [place];
}

function refused(page, bound, other) {
  const act = async () => {
    await post(`/experiments/${page.id}/accept-versions`);
    await page.look();
  };
  const button = h("button", { type: "button", class: "quiet", onclick: () => ask({
    title: "Go on under other versions?",
    words: "Its numbers need not be those that the first versions would have given. Which were used is recorded.",
    action: "Go on", danger: true, act,
  }, page.signal) }, "Let it go on…");
  return h("div", { class: "remark warned" }, h("p", {}, `It was begun with ${bound}; a supervisor with ${other} leaves it alone.`), button);
}

function use({ since, repetitions, provenance: under }) {
  const versions = Object.entries({ ...under.engines, ...under.libraries }).map(([name, version]) => `${name} ${version.replace(`${name} `, "")}`);
  const commit = under.commit ? `${under.commit.slice(0, 12)}${under.dirty ? ", with changes" : ""}` : "not known";
  const facts = [
    ["Since", new Date(since).toLocaleString()], ["Repetitions", repetitions], ["gaplab", `${under.gaplab} (code ${under.code})`],
    ["Commit", commit], ["Python", under.python], ["Libraries", versions.join(", ")],
    ["Machine", `${under.processor}, ${under.architecture}`], ["System", under.system], ["Version of the spec", under.spec_version],
  ];
  const line = ([name, value]) => h("div", {}, h("dt", {}, name), h("dd", {}, String(value)));
  return framed("Provenance", h("dl", { class: "facts stacked" }, ...facts.map(line)));
}
