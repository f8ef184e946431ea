// @ts-check
/** The actions on a study, each for all of its experiments whose state permits it, or on one experiment; those that are refused say why. */

import { getTagged, patch, post, Problem, put, remove } from "../../lib/api.js";
import { confirmingCost, openDialog } from "../../lib/dialog.js";
import { h, setText, tellingErrors } from "../../lib/dom.js";
import { count } from "../../lib/format.js";
import { stringify } from "../../lib/json.js";
import { ENDED } from "../../lib/state_badge.js";
import { tagsIn } from "../../lib/tags.js";

/** @typedef {"pause" | "resume" | "stop" | "cancel" | "extend" | "retry"} Action */

const CHANGED_MEANWHILE = 412;

/** The states of an experiment in which an action is permitted, as gaplab.schemas.lifecycle has them. @type {Record<Action, Api.State[]>} */
export const PERMITTED = {
  pause: ["QUEUED", "RUNNING", "WAITING"],
  resume: ["PAUSING", "PAUSED"],
  stop: ["QUEUED", "RUNNING", "WAITING", "PAUSING", "PAUSED"],
  cancel: ["QUEUED", "RUNNING", "WAITING", "PAUSING", "PAUSED", "STOPPING"],
  extend: ["COMPLETED"],
  retry: ["QUEUED", "RUNNING", "WAITING", "PAUSED", "COMPLETED", "FAILED"],
};

/** @type {[action: Action, label: string, participle: string][]} */
const ACTIONS = [["pause", "Pause", "paused"], ["resume", "Resume", "resumed"], ["stop", "Stop…", "stopped"], ["cancel", "Cancel…", "cancelled"],
  ["extend", "Extend…", "extended"], ["retry", "Retry", "retried"]];

/** Return whether a study stands for one of its experiments, of which there are others. @param {Api.StudyRead} study */
export const isAmongOthers = ({ id, experiments: [first] }) => first.study !== id;

/**
 * Return the experiments that an action goes to: only one with a failed repetition can be retried.
 * @param {Pick<Api.StudyRead, "experiments">} study
 * @param {Action} action
 */
const permitting = ({ experiments }, action) =>
  experiments.filter(({ state, progress }) => PERMITTED[action].includes(state) && (action !== "retry" || progress.failed > 0));

/** Return why an action is refused, or the empty text. @param {Action} action @param {Pick<Api.StudyRead, "experiments">} study */
export function refusal(action, study) {
  const [{ state, progress }, ...others] = study.experiments;
  if (permitting(study, action).length) return "";
  if (action === "retry" && (others.length || !progress.failed)) return "None of its repetitions has failed, so none can be retried.";
  const participle = ACTIONS.find(([name]) => name === action)?.[2];
  const states = PERMITTED[action].map((permitted) => permitted.toLowerCase());
  const only = states.length > 1 ? `${states.slice(0, -1).join(", ")} or ${states.at(-1)}` : states[0];
  return others.length ? `None of its experiments can be ${participle} now: only one that is ${only} can.`
    : `An experiment that is ${state.toLowerCase()} cannot be ${participle}, only one that is ${only}.`;
}

/** Return the action that a person most likely wants now; null if that is to look at results, or to measure. @param {Api.StudyRead} study @returns {Action | null} */
export function primary(study) {
  if (study.state === "WAITING") return null;
  const permitted = /** @type {Action[]} */ (["resume", "pause"]).find((action) => PERMITTED[action].includes(study.state));
  return permitted ?? (study.state === "FAILED" && !refusal("retry", study) ? "retry" : null);
}

/** Return the view of a study's results: the comparison, or of one experiment its motion or its function. @param {Page.StudyPage} page */
function resultsLink({ study, isFunction }) {
  const [{ id }, ...others] = study.experiments;
  const [label, href] = others.length ? ["Compare its experiments", compared(study)]
    : isFunction ? ["Step through the function", `#/toy?experiment=${id}`] : ["Replay a controller", `#/replay?experiment=${id}`];
  return h("a", { href }, label);
}

/** Return the address of the comparison of a study's experiments. @param {Pick<Api.StudyRead, "experiments">} study */
export const compared = ({ experiments }) => `#/compare?experiments=${experiments.map(({ id }) => id).join(",")}`;

/**
 * Return the one action that is most likely wanted, the way to the results, and all other actions behind a button; they are updated when `page.study` has changed.
 * One that is refused can still be reached, and says why. Archiving and deleting wait until everything has ended. One experiment
 * among others has a name of its own, and its study has the rest.
 * @param {Page.StudyPage} page
 * @returns {Page.Updatable}
 */
export function actions(page) {
  const message = h("p", { class: "outcome", role: "status" });
  const telling = tellingErrors(message);
  const isOne = isAmongOthers(page.study);
  const hasEnded = () => page.study.experiments.every(({ state }) => ENDED.includes(state));
  /** @type {Record<string, (action: Action) => unknown>} */
  const asking = { stop: () => stop(page), cancel: () => cancel(page), extend: () => extend(page) };
  const buttonOf = (/** @type {string} */ label, /** @type {() => unknown} */ act) => h("button", { type: "button", class: "quiet", onclick: telling(act) }, label);
  /** @type {(label: string, participle: string, act: () => unknown) => HTMLButtonElement} */
  const whenEnded = (label, participle, act) => buttonOf(label, () => {
    if (!hasEnded()) throw new Error(`Only what has ended can be ${participle}: stop or cancel it first.`);
    return act();
  });
  const verbs = ACTIONS.map(([action, label]) => buttonOf(label, () => {
    const reason = refusal(action, page.study);
    if (reason) throw new Error(reason);
    return (asking[action] ?? ((name) => send(page, name)))(action);
  }));
  const [archiving, deleting] = [whenEnded("", "archived", () => archive(page)), whenEnded("Delete…", "deleted", () => askToDelete(page))];
  const others = [
    ...verbs, buttonOf("Change schedule…", () => { schedule(page); }), buttonOf(isOne ? "Edit name" : "Edit name, notes and tags", () => { edit(page); }),
    buttonOf("New from this", () => again(page)), ...(isOne ? [] : [archiving, buttonOf("Notify…", () => { askWhomToTell(page); })]), deleting];
  const link = resultsLink(page);
  const more = h("button", { type: "button", class: "quiet", "aria-expanded": "false", onclick: () => {
    more.setAttribute("aria-expanded", String(more.getAttribute("aria-expanded") === "false"));
    update();
  } });
  const update = () => {
    const wanted = primary(page.study);
    const isOpen = more.getAttribute("aria-expanded") === "true";
    verbs.forEach((each, index) => {
      const reason = refusal(ACTIONS[index][0], page.study);
      each.setAttribute("aria-disabled", String(Boolean(reason)));
      each.title = reason;
    });
    others.forEach((each, index) => {
      const isWanted = ACTIONS[index]?.[0] === wanted;
      each.hidden = !isWanted && !isOpen;
      each.setAttribute("class", isWanted ? "" : "quiet");
    });
    setText(archiving, page.study.archived_at ? "Unarchive" : "Archive");
    for (const one of [archiving, deleting]) one.setAttribute("aria-disabled", String(!hasEnded()));
    setText(more, isOpen ? "Fewer actions" : "More actions…");
    link.setAttribute("class", wanted || page.study.state === "WAITING" ? "button quiet" : "button");
  };
  update();
  return { element: h("div", { class: "life-cycle" }, h("div", { role: "group", "aria-label": "Actions" }, ...others, link, more), message), update };
}

/** @param {Page.StudyPage} page @param {Action} action @param {unknown} [body] */
async function send(page, action, body = undefined) {
  const done = await confirmingCost((query) => post(`/studies/${page.id}/${action}${query}`, body), page.signal);
  if (!done) throw new Error("Nothing was changed.");
  await page.reload();
}

/** Return to how many experiments an action goes; nothing where that is clear. @param {Page.StudyPage} page @param {Action} action */
function concerned({ study }, action) {
  const some = permitting(study, action).length;
  return some < study.experiments.length ? `This concerns ${count(some)} of its ${count(study.experiments.length)} experiments. ` : "";
}

/** @param {Page.StudyPage} page */
function stop(page) {
  openDialog({
    title: `Stop “${page.study.name}”?`,
    text: `${concerned(page, "stop")}Running repetitions finish their step, and an experiment is completed with the results it has. `
      + "If its curve has no point yet, it is cancelled instead.",
    action: "Stop it", danger: true, act: () => send(page, "stop"),
  }, page.signal);
}

/** @param {Page.StudyPage} page */
function cancel(page) {
  openDialog({
    title: `Cancel “${page.study.name}”?`,
    text: `${concerned(page, "cancel")}It ends at once, and the steps under way are lost. Stored results stay, but what is cancelled can never go on.`,
    action: "Cancel it", danger: true, act: () => send(page, "cancel"),
  }, page.signal);
}

/** @param {Page.StudyPage} page */
function extend(page) {
  const extended = permitting(page.study, "extend");
  /** @type {(name: "iterations" | "repetitions", label: string, max: number) => import("../../lib/dialog.js").Field[]} the direct baseline has no iterations, and may have other totals */
  const total = (name, label, max) => {
    const totals = extended.filter(({ level }) => name === "repetitions" || !level).map(({ spec }) => spec[name]);
    if (!totals.length) return [];
    const [least, most] = [Math.min(...totals), Math.max(...totals)];
    return [{ name, label, value: "", hint: `Now ${count(least)}${most > least ? ` to ${count(most)}` : ""}. Empty: unchanged.`, type: "number", min: 1, max, step: 1 }];
  };
  openDialog({
    title: `Extend “${page.study.name}”`,
    text: `${concerned(page, "extend")}Enter totals, not what to add. Results so far stay, and all is then as if it had been submitted with these totals. `
      + "What is larger already stays as it is. To finish what was stopped, leave the totals empty.",
    fields: [...total("iterations", "Iterations in all", 1000), ...total("repetitions", "Repetitions in all", 10000)],
    action: "Extend it",
    act: (values) => send(page, "extend", Object.fromEntries(Object.entries(values).filter(([, value]) => value).map(([name, value]) => [name, Number(value)]))),
  }, page.signal);
}

/** @param {Page.StudyPage} page */
function schedule(page) {
  const { experiments } = page.study;
  const common = (/** @type {"priority" | "max_parallel"} */ name) => (new Set(experiments.map((each) => each[name])).size > 1 ? "" : String(experiments[0][name] ?? ""));
  const before = { priority: common("priority"), max_parallel: common("max_parallel") };
  const whole = { type: "number", step: 1 };
  openDialog({
    title: "Change the schedule",
    text: "This changes no result, and stops nothing that runs. What is left as it is stays so.",
    fields: [
      { name: "priority", label: "Priority", value: before.priority, min: -10, max: 10, hint: "−10 to 10; the highest is computed first", ...whole },
      { name: "max_parallel", label: "Repetitions at once", value: before.max_parallel, min: 1, max: 10000, hint: "of each experiment; empty: one on every free core", ...whole },
    ],
    action: "Change it",
    act: async ({ priority, max_parallel: atOnce }) => {
      await patch(`/studies/${page.id}/schedule`, {
        ...(priority !== before.priority && priority ? { priority: Number(priority) } : {}),
        ...(atOnce !== before.max_parallel ? { max_parallel: atOnce ? Number(atOnce) : null } : {}),
      });
      await page.reload();
    },
  }, page.signal);
}

/** Open the form with the same spec. @param {Page.StudyPage} page */
async function again({ id }) {
  const { spec, remarks } = (await getTagged(`/studies/${id}/spec`)).value;  // the seed keeps all its digits
  if (!spec) throw new Error(remarks.join("; "));
  location.hash = `#/new?${new URLSearchParams({ spec: stringify(spec), ...(remarks.length ? { note: remarks.join("; ") } : {}) })}`;
}

/** @param {Page.StudyPage} page */
async function archive({ id, study, reload }) {
  await post(`/studies/${id}/${study.archived_at ? "unarchive" : "archive"}`);
  await reload();
}

/**
 * Ask for a name, notes and tags, and store them, unless somebody else has changed them since the page read them. One experiment among
 * others has a name alone.
 * @param {Page.StudyPage} page
 */
function edit(page) {
  const { name, notes, tags } = page.study;
  const isName = isAmongOthers(page.study);
  let tag = page.tag;
  const act = async (/** @type {Record<string, string>} */ values) => {
    const wanted = { name: values.name, ...(isName ? {} : { notes: values.notes || null, tags: tagsIn(values.tags) }) };
    try {
      page.take(await patch(`/studies/${page.id}`, wanted, { "If-Match": String(tag) }));
    } catch (error) {
      if (error.status !== CHANGED_MEANWHILE) throw error;
      await page.reload();
      tag = page.tag;
      const { study } = page;
      const stored = { name: study.name, ...(isName ? {} : { notes: study.notes || null, tags: study.tags }) };
      if (JSON.stringify(stored) === JSON.stringify(wanted)) return;  // it was saved, and the answer was lost
      const detail = `Somebody changed it meanwhile: its name is “${study.name}”, its notes are “${study.notes ?? ""}”, its tags “${study.tags.join(" ")}”. Save again to overwrite that.`;
      throw new Problem({ status: error.status, title: error.title, detail });
    }
  };
  openDialog({
    title: isName ? "Edit name" : "Edit name, notes and tags",
    fields: [
      { name: "name", label: "Name", value: name, required: true, maxlength: 200, autocomplete: "off" },
      ...(isName ? [] : [
        { name: "notes", label: "Notes", value: notes, multiline: true, rows: 5, maxlength: 10000, hint: "Markdown: *emphasis*, `code`, - lists, [links](address)" },
        { name: "tags", label: "Tags", value: tags.join(" "), autocomplete: "off", hint: "letters, digits and _ . : / + -, separated by spaces" }]),
    ],
    action: "Save",
    act,
  }, page.signal);
}

/** Delete it once the reader has typed its name. @param {Page.StudyPage} page */
function askToDelete({ id, study, signal }) {
  const { name, experiments, progress: { repetitions } } = study;
  const what = `${experiments.length > 1 ? `${count(experiments.length)} experiments and ` : ""}${count(repetitions)} repetitions`;
  openDialog({
    title: "Delete it for good?",
    text: `This deletes “${name}” with ${what}. Nothing can bring it back but an archive: save one first if somebody may need it.`,
    fields: [{ name: "typed", label: "Type its name to confirm", value: "", required: true, autocomplete: "off" }],
    action: "Delete it", danger: true,
    act: async ({ typed }) => {
      if (typed.trim().toLowerCase() !== name.trim().toLowerCase()) throw new Error(`That is not its name, which is “${name}”.`);
      await remove(`/studies/${id}`);
      location.hash = isAmongOthers(study) ? `#/studies/${experiments[0].study}` : "#/";
    },
  }, signal);
}

/** @param {Page.StudyPage} page */
function askWhomToTell({ id, signal }) {
  openDialog({
    title: "Tell a webhook when it has ended",
    text: "The address gets a POST once. The owner of the service lists the hosts that are permitted.",
    fields: [{ name: "url", label: "Address", value: "", type: "url", hint: "empty: tell none", maxlength: 1000, autocomplete: "off" }],
    action: "Save",
    act: async ({ url }) => { await (url ? put(`/studies/${id}/webhook`, { url }) : remove(`/studies/${id}/webhook`)); },
  }, signal);
}
