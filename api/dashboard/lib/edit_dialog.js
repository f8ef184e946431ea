// @ts-check
/** The dialog that changes a name, notes and tags, and overwrites nobody's change unseen. */

import { patch, Problem } from "./api.js";
import { openDialog } from "./dialog.js";
import { tagsIn } from "./tags.js";

const CHANGED_MEANWHILE = 412;

/**
 * Ask for a name, notes and tags, and store them, unless somebody else has changed them since the page read them.
 *
 * @param {Page.Editable} page
 * @param {string} path of the study or the experiment
 * @param {() => { name: string, notes: string | null, tags: string[] }} current what the page shows now
 */
export function editNameAndNotes(page, path, current) {
  const { name, notes, tags } = current();
  let tag = page.tag;
  const act = async (/** @type {Record<string, string>} */ values) => {
    try {
      page.take(await patch(path, { name: values.name, notes: values.notes || null, tags: tagsIn(values.tags) }, { "If-Match": String(tag) }));
    } catch (error) {
      if (error.status !== CHANGED_MEANWHILE) throw error;
      await page.reload();
      tag = page.tag;
      const { name: storedName, notes: storedNotes, tags: storedTags } = current();
      if (storedName === values.name && (storedNotes ?? "") === values.notes && String(storedTags) === String(tagsIn(values.tags))) return;  // it was saved, and the answer was lost
      const detail = `Somebody changed it meanwhile: its name is “${storedName}”, its notes are “${storedNotes ?? ""}”, its tags “${storedTags.join(" ")}”. Save again to overwrite that.`;
      throw new Problem({ status: error.status, title: error.title, detail });
    }
  };
  openDialog({
    title: "Edit name, notes and tags",
    fields: [
      { name: "name", label: "Name", value: name, required: true, maxlength: 200, autocomplete: "off" },
      { name: "notes", label: "Notes", value: notes, multiline: true, rows: 5, maxlength: 10000, hint: "Markdown: *emphasis*, `code`, - lists, [links](address)" },
      { name: "tags", label: "Tags", value: tags.join(" "), autocomplete: "off", hint: "letters, digits and _ . : / + -, separated by spaces" },
    ],
    action: "Save",
    act,
  }, page.signal);
}
