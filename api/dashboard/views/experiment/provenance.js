// @ts-check
/** The software and the machines that computed an experiment. */

import { get, post } from "../../lib/api.js";
import { openDialog } from "../../lib/dialog.js";
import { h } from "../../lib/dom.js";
import { factItems } from "../../lib/head_parts.js";
import { empty } from "../../lib/placeholders.js";
import { framed } from "../../lib/table.js";

const KINDS = ["repetition_claimed", "versions_refused", "versions_accepted", "completed"];

/**
 * Return a list of every software and machine that computed a part of the experiment.
 *
 * @param {Page.ExperimentPage} page
 */
export function provenance(page) {
  const place = h("div");
  page.sections.add(place, KINDS, async () => {
    /** @type {Api.ProvenanceRead} */
    const { computed_with: versions, refused_by: others, uses } = await get(`/experiments/${page.id}/provenance`, {}, page.signal);
    place.replaceChildren(...(others ? [refusedBlock(page, versions, others)] : []),
      ...(uses.length ? uses.map(useBlock) : [empty("No supervisor of this service has computed any part of it.")]));
  });
  return [place];
}

/**
 * @param {Page.ExperimentPage} page
 * @param {string | null} versions
 * @param {string} others
 */
function refusedBlock(page, versions, others) {
  const accept = async () => {
    await post(`/experiments/${page.id}/accept-versions`);
    await page.reload();
  };
  const ask = () => openDialog({
    title: "Continue under other versions?",
    text: "Its numbers may then differ from those of the first versions. The provenance records which versions were used.",
    action: "Continue", danger: true, act: accept,
  }, page.signal);
  const text = `It was begun with ${versions}. A supervisor with ${others} does not continue it.`;
  return h("div", { class: "remark warned" }, h("p", {}, text), h("button", { type: "button", class: "quiet", onclick: ask }, "Let it continue…"));
}

/** @param {Api.ProvenanceUse} use */
function useBlock({ since, repetitions, provenance: used }) {
  const versions = Object.entries({ ...used.engines, ...used.libraries }).map(([name, version]) => `${name} ${version.replace(`${name} `, "")}`);
  const commit = used.commit ? `${used.commit.slice(0, 12)}${used.dirty ? ", with changes" : ""}` : "not known";
  const facts = factItems([
    ["Since", new Date(since).toLocaleString()], ["Repetitions", repetitions], ["gaplab", `${used.gaplab} (code ${used.code})`],
    ["Commit", commit], ["Python", used.python], ["Libraries", versions.join(", ")],
    ["Machine", `${used.processor}, ${used.architecture}`], ["System", used.system], ["Version of the spec", used.spec_version],
  ]);
  return framed("Provenance", h("dl", { class: "facts stacked" }, ...facts));
}
