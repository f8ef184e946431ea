// @ts-check
/** Buttons that archive, delete and follow a study or an experiment. */

import { post, Problem, put, remove } from "./api.js";
import { openDialog } from "./dialog.js";
import { h, setText } from "./dom.js";

/**
 * @typedef {object} Kept what the buttons need to know of a study or an experiment
 * @property {string} name
 * @property {string} what it would lose, for the question: "12 repetitions"
 * @property {boolean} hasEnded
 * @property {boolean} isArchived
 */

/**
 * Return the buttons; archiving and deleting wait until everything has ended.
 *
 * @param {Page.Editable} page
 * @param {string} path of the study or the experiment
 * @param {() => Kept} current
 * @returns {Page.Updatable}
 */
export function keepingButtons(page, path, current) {
  const message = h("p", { class: "outcome", role: "status" });
  const press = (/** @type {() => unknown} */ act) => async () => {
    message.textContent = "";
    try {
      await act();
    } catch (error) {
      message.textContent = error.message;
    }
  };
  const whenEnded = (/** @type {string} */ participle, /** @type {() => unknown} */ act) => press(() => {
    if (!current().hasEnded) throw new Problem({ detail: `Only what has ended can be ${participle}: stop or cancel it first.` });
    return act();
  });
  const archive = async () => {
    await post(`${path}/${current().isArchived ? "unarchive" : "archive"}`);
    await page.reload();
  };
  const button = (/** @type {string} */ label, /** @type {() => unknown} */ onclick) => h("button", { type: "button", class: "quiet small", onclick }, label);
  const archiving = button("", whenEnded("archived", archive));
  const deleting = button("Delete…", whenEnded("deleted", () => askToDelete(page, path, current())));
  const update = () => {
    const { hasEnded, isArchived } = current();
    setText(archiving, isArchived ? "Unarchive" : "Archive");
    for (const one of [archiving, deleting]) one.setAttribute("aria-disabled", String(!hasEnded));
  };
  update();
  const group = h("div", { role: "group", "aria-label": "Keep" }, archiving, deleting, button("Notify…", press(() => askWhomToTell(page, path))));
  return { element: h("div", { class: "life-cycle keeping" }, group, message), update };
}

/**
 * Delete it once the reader has typed its name.
 *
 * @param {Page.Editable} page
 * @param {string} path
 * @param {Kept} kept
 */
function askToDelete(page, path, { name, what }) {
  openDialog({
    title: "Delete it for good?",
    text: `This deletes “${name}” with ${what}. Nothing can bring it back but an archive: save one first if somebody may need it.`,
    fields: [{ name: "typed", label: "Type its name to confirm", value: "", required: true, autocomplete: "off" }],
    action: "Delete it", danger: true,
    act: async ({ typed }) => {
      if (typed.trim().toLowerCase() !== name.trim().toLowerCase()) throw new Problem({ detail: `That is not its name, which is “${name}”.` });
      await remove(path);
      location.hash = "#/";
    },
  }, page.signal);
}

/**
 * @param {Page.Editable} page
 * @param {string} path
 */
function askWhomToTell(page, path) {
  openDialog({
    title: "Tell a webhook when it has ended",
    text: "The address gets a POST once. The owner of the service lists the hosts that are permitted.",
    fields: [{ name: "url", label: "Address", value: "", type: "url", hint: "empty: tell none", maxlength: 1000, autocomplete: "off" }],
    action: "Save",
    act: async ({ url }) => {
      await (url ? put(`${path}/webhook`, { url }) : remove(`${path}/webhook`));
    },
  }, page.signal);
}
