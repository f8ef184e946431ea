// @ts-check
/** The dialog that changes a name and notes, and overwrites nobody's change unseen. */

import { patch, Problem } from "./api.js";
import { openDialog } from "./dialog.js";

const CHANGED_MEANWHILE = 412;

/**
 * Ask for a name and notes, and store them, unless somebody else has changed them since the page read them.
 *
 * @param {Page.Editable} page
 * @param {string} path of the study or the experiment
 * @param {() => { name: string, notes: string | null }} current what the page shows now
 */
export function editNameAndNotes(page, path, current) {
  const { name, notes } = current();
  let tag = page.tag;
  const act = async (/** @type {Record<string, string>} */ values) => {
    try {
      page.take(await patch(path, { name: values.name, notes: values.notes || null }, { "If-Match": String(tag) }));
    } catch (error) {
      if (error.status !== CHANGED_MEANWHILE) throw error;
      await page.reload();
      tag = page.tag;
      const { name: storedName, notes: storedNotes } = current();
      if (storedName === values.name && (storedNotes ?? "") === values.notes) return;  // it was saved, and the answer was lost
      const detail = `Somebody changed it meanwhile: its name is “${storedName}”, its notes are “${storedNotes ?? ""}”. Save again to overwrite that.`;
      throw new Problem({ status: error.status, title: error.title, detail });
    }
  };
  openDialog({
    title: "Edit name and notes",
    fields: [
      { name: "name", label: "Name", value: name, required: true, maxlength: 200, autocomplete: "off" },
      { name: "notes", label: "Notes", value: notes, multiline: true, rows: 5, maxlength: 10000 },
    ],
    action: "Save",
    act,
  }, page.signal);
}
