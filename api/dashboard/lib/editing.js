/** Another name or other notes; nobody's change is written over unseen. */

import { patch, Problem } from "./api.js";
import { ask } from "./dialog.js";

const CHANGED_MEANWHILE = 412;

/**
 * Ask for them, and send them to `address` with the tag of what was looked at; `shown()` is what the page shows now, and
 * what they were changed to is what it takes, with its tag.
 */
export function edit(page, address, shown) {
  const { name, notes } = shown();
  let tag = page.tag;
  const act = async (values) => {
    try {
      page.take(await patch(address, { name: values.name, notes: values.notes || null }, { "If-Match": tag }));
    } catch (error) {
      if (error.status !== CHANGED_MEANWHILE) throw error;
      await page.look();
      tag = page.tag;
      const { name: theirs, notes: written } = shown();
      if (theirs === values.name && (written ?? "") === values.notes) return;  // it was saved, and the answer was lost
      const detail = `Somebody changed it meanwhile: its name is “${theirs}”, its notes are “${written ?? ""}”. Save again to write over that.`;
      throw new Problem({ status: error.status, title: error.title, detail });
    }
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
