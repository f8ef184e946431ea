/** Another name or other notes of a study; nobody's change is written over unseen. */

import { patch, Problem } from "../../lib/api.js";
import { ask } from "../../lib/dialog.js";

const CHANGED_MEANWHILE = 412;

/** Ask for them, and send them with the tag of what was looked at. */
export function edit(page) {
  const { name, notes } = page.study;
  let { tag } = page;
  const act = async (values) => {
    try {
      await patch(`/studies/${page.id}`, { name: values.name, notes: values.notes || null }, { "If-Match": tag });
    } catch (error) {
      if (error.status !== CHANGED_MEANWHILE) throw error;
      await page.look();
      ({ tag } = page);
      const { name: theirs, notes: written } = page.study;
      const found = `its name is “${theirs}”, its notes are “${written ?? ""}”`;
      throw new Problem({ ...error, detail: `Somebody changed it meanwhile: ${found}. Save again to write over that.` });
    }
    await page.look();
  };
  ask({
    title: "Edit name and notes",
    fields: [
      { name: "name", label: "Name", value: name, required: true, maxlength: 200, autocomplete: "off" },
      { name: "notes", label: "Notes", value: notes, multiline: true, rows: 5, maxlength: 10000 },
    ],
    action: "Save",
    act,
  }, page.signal);
}
