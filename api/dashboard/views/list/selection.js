// @ts-check
/** What is ticked in lists: experiments to compare, and studies, of which all experiments are ticked, to tag, archive, export or delete. */

import { getFile, patch, post, remove } from "../../lib/api.js";
import { openDialog } from "../../lib/dialog.js";
import { button, h } from "../../lib/dom.js";
import { save } from "../../lib/downloads.js";
import { count } from "../../lib/format.js";
import { tagsIn } from "../../lib/tags.js";

/** @type {Set<string>} ids of experiments; they stay ticked while the reader visits other parts of the page */
const ticked = new Set();

/** @type {Map<string, Api.StudyRead>} the studies that a list has shown, as they were last */
const known = new Map();

/** @param {Api.StudyRead | Api.ExperimentRead} value */
const idsOf = (value) => ("experiments" in value ? value.experiments.map(({ id }) => id) : [value.id]);

const wholeStudies = () => [...known.values()].filter((study) => study.experiments.length > 0 && idsOf(study).every((id) => ticked.has(id)));

/** @param {number} number @param {string} one @param {string} many */
const numberOf = (number, one, many) => (number ? [`${count(number)} ${number === 1 ? one : many}`] : []);

/**
 * Return a box that ticks the experiments of a row; it is half ticked while only some of them are.
 * @param {string} label
 * @param {() => void} changed
 * @returns {Page.Updatable<Api.StudyRead | Api.ExperimentRead>}
 */
export function tickBox(label, changed) {
  /** @type {string[]} */
  let ids = [];
  const tick = () => {
    for (const id of ids) ticked[box.checked ? "add" : "delete"](id);
    changed();
  };
  const box = h("input", { type: "checkbox", "aria-label": label, onchange: tick });
  const update = (/** @type {Api.StudyRead | Api.ExperimentRead} */ value) => {
    ids = idsOf(value);
    if ("experiments" in value) known.set(value.id, value);
    const tickedCount = ids.filter((id) => ticked.has(id)).length;
    box.checked = ids.length > 0 && tickedCount === ids.length;
    box.indeterminate = tickedCount > 0 && tickedCount < ids.length;
  };
  return { element: box, update };
}

/**
 * Return the bar with what can be done with all that is ticked.
 * @param {() => void} changed called when the bar has unticked or changed something
 * @param {AbortSignal | null} [signal] of a list of studies; without it, experiments are only compared
 * @returns {Page.Updatable}
 */
export function selectionBar(changed, signal = null) {
  const text = h("span", { role: "status" });
  const outcome = h("span", { role: "status", class: "outcome" });
  const compare = h("a", { class: "button" }, "Compare");
  const clear = () => {
    ticked.clear();
    outcome.textContent = "";
    update();
    changed();
  };
  const tell = (/** @type {string} */ told) => {
    outcome.textContent = told;
    update();
  };
  const deeds = h("span", { class: "bulk" }, ...(signal ? deedButtons(signal, tell, changed) : []));
  const element = h("div", { class: "selection", role: "region", "aria-label": "Selected experiments", hidden: true }, text, compare, deeds,
    button("Clear", clear), outcome);
  const update = () => {
    const studies = wholeStudies();
    const others = ticked.size - studies.flatMap(idsOf).length;
    element.hidden = !ticked.size && !outcome.textContent;
    text.textContent = [...numberOf(studies.length, "study", "studies"), ...numberOf(others, "experiment", "experiments")].join(" and ") + (ticked.size ? " selected" : "");
    compare.href = `#/compare?experiments=${[...ticked].join(",")}`;
    compare.hidden = !ticked.size;
    deeds.hidden = !studies.length;
    const archiving = deeds.querySelector("[data-archive]");
    if (archiving) archiving.textContent = areArchived(studies) ? "Unarchive" : "Archive";
  };
  update();
  return { element, update };
}

/** @param {Api.StudyRead[]} studies */
const areArchived = (studies) => studies.every(({ archived_at: at }) => at !== null);

/**
 * Return the buttons for all ticked studies.
 * @param {AbortSignal} signal
 * @param {(told: string) => void} tell is told how far it is, and in the end what became of it
 * @param {() => void} changed
 */
function deedButtons(signal, tell, changed) {
  /** Do something to each study, and tell how many it was done to, and why others refused. @type {(participle: string, act: (study: Api.StudyRead) => Promise<unknown>) => Promise<void>} */
  const toEach = async (participle, act) => {
    const studies = wholeStudies();
    const refused = [];
    for (const [index, study] of studies.entries()) {
      if (studies.length > 1) tell(`${index + 1} of ${studies.length}…`);
      try {
        await act(study);
      } catch (error) {
        refused.push(`“${study.name}” was not: ${error.message}`);
      }
    }
    tell([`${numberOf(studies.length - refused.length, "study", "studies")[0] ?? "None"} ${participle}.`, ...refused].join(" "));
    changed();
  };
  const archive = () => {
    const verb = areArchived(wholeStudies()) ? "unarchive" : "archive";
    return toEach(`${verb}d`, async ({ id }) => { known.set(id, await post(`/studies/${id}/${verb}`)); });
  };
  const download = () => toEach("exported", async ({ id }) => save(await getFile(`/studies/${id}/export`), `gaplab-${id}.zip`));
  const tag = () => openDialog({
    title: "Tag the selected studies",
    fields: [
      { name: "added", label: "Add", value: "", autocomplete: "off", hint: "letters, digits and _ . : / + -, separated by spaces" },
      { name: "removed", label: "Remove", value: "", autocomplete: "off" }],
    action: "Tag them",
    act: async ({ added, removed }) => {
      const change = { add_tags: tagsIn(added), remove_tags: tagsIn(removed) };
      if (!change.add_tags.length && !change.remove_tags.length) throw new Error("Name a tag to add or to remove.");
      await toEach("tagged", ({ id }) => patch(`/studies/${id}`, change, { "If-Match": "*" }));
    },
  }, signal);
  const askToDelete = () => {
    const studies = wholeStudies();
    openDialog({
      title: `Delete ${studies.length === 1 ? "it" : "all of them"} for good?`,
      text: `This deletes ${studies.map(({ name }) => `“${name}”`).join(", ")}, with all results. Nothing can bring them back but an archive: export them first if somebody may need them.`,
      fields: [{ name: "typed", label: `Type the number of studies, ${studies.length}, to confirm`, value: "", required: true, autocomplete: "off", inputmode: "numeric" }],
      action: "Delete for good", danger: true,
      act: async ({ typed }) => {
        if (Number(typed) !== studies.length) throw new Error(`That is not their number, which is ${studies.length}.`);
        await toEach("deleted", async (study) => {
          await remove(`/studies/${study.id}`);
          for (const id of idsOf(study)) ticked.delete(id);
          known.delete(study.id);
        });
      },
    }, signal);
  };
  return [button("Tag…", tag), button("Archive", archive, { "data-archive": true }), button("Export", download), button("Delete…", askToDelete)];
}
