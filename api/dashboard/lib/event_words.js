// @ts-check
/** Events in words. */

import { count, number } from "./format.js";

/** @typedef {(event: Api.EventRead) => string} Words */

/** @type {Words} */
const which = ({ repetition }) => `Repetition ${repetition}`;

/** @type {Words} */
const step = ({ repetition, body }) => `Repetition ${repetition}, iteration ${body.iteration}`;

/** @type {Words} */
const reason = ({ body }) => (body.reason ? `: ${body.reason}` : "");

/**
 * Return a fitness after some words, or that there is none because the physics failed.
 * @param {string} words
 * @param {number | null | undefined} value
 * @param {string} [where]
 */
const reaching = (words, value, where = "") => (value === null || value === undefined ? `the physics failed${where}` : `${words} ${number(value)}${where}`);

/** @type {(words: string, value: number | null | undefined, where?: string) => string} a robot on a bench fails for other reasons than physics */
const inReality = (words, value, where = "") => (value === null || value === undefined ? "failed in reality" : `${words} ${number(value)}${where}`);

const TAG_FIELDS = ["tags", "add_tags", "remove_tags"];

/** @type {Record<string, Words>} */
const WORDS = {
  submitted: ({ body }) => `Submitted, with ${count(body.repetitions)} repetitions`,
  imported: () => "Imported from an archive",
  started: () => "Started",
  waiting: () => "Waiting for measurements of the robot on the bench",
  pausing: ({ body }) => `Pausing: ${body.reason ?? "running repetitions finish their step"}`,
  paused: () => "Paused",
  resumed: () => "Resumed",
  stopping: () => "Stopping: running repetitions finish their step",
  extended: ({ body }) => `Extended to ${count(body.iterations)} iterations, ${count(body.repetitions)} repetitions`,
  completed: () => "Completed",
  failed: () => "Failed",
  cancelled: () => "Cancelled",
  retried: () => "Retried",
  edited: ({ body }) => `Edited: ${edits(body)}`,
  archived: () => "Archived: lists leave it out",
  unarchived: () => "Listed again",
  deleted: ({ body }) => `Deleted: ${body.name}`,
  notified: ({ body }) => `Told ${channel(body)} of the end of the study`,
  notification_failed: ({ body }) =>
    `Could not tell ${channel(body)} of the end of the study: ${body.reason}${body.again_in_s ? `; again in ${count(body.again_in_s)} s` : "; given up"}`,
  sensitivity_ended: ({ body }) =>
    `Sensitivity check ${String(body.state).toLowerCase()}${body.warnings?.length ? `: ${body.warnings.join(" ")}` : ""}`,
  versions_refused: ({ body }) => / \(unavailable: /.test(body.refused_by)
    ? `Refused by a supervisor that cannot use its plug-ins: ${body.refused_by}`
    : `Refused by a supervisor with other versions: ${body.refused_by}, not ${body.computed_with}`,
  versions_accepted: () => "Other versions were accepted: it continues under them",
  repetition_claimed: (event) => `${which(event)} ${event.body.steps ? `continues after ${count(event.body.steps)} steps` : "begins"}`,
  repetition_completed: (event) => `${which(event)} completed`,
  repetition_failed: (event) => `${which(event)} failed${reason(event)}`,
  repetition_lost: (event) => `${which(event)} lost its worker, and is queued again${reason(event)}`,
  repetition_handed_back: (event) => `${which(event)} was handed back${reason(event)}`,
  repetition_waits: (event) => `${which(event)} waits for a measurement`,
  repetition_paused: (event) => `${which(event)} paused`,
  repetition_stopped: (event) => `${which(event)} stopped`,
  repetition_cancelled: (event) => `${which(event)} cancelled`,
  requested: (event) => `${step(event)}: a measurement of the ${event.body.kind === "probe" ? "transferred controller" : "sample"} is requested`,
  refused: (event) => `${step(event)}: refused before it was offered${reason(event)}`,
  taken: (event) => `${step(event)}: taken by ${event.body.operator}`,
  released: (event) => `${step(event)}: given back by ${event.body.by ?? event.body.operator} without an answer${event.body.reason ? `, taken by ${event.body.operator}: ${event.body.reason}` : ""}`,
  take_expired: (event) => `${step(event)}: ${event.body.operator} gave no sign of life, so the measurement is open again`,
  conflicting: (event) => `${step(event)}: an answer by ${event.body.operator} is in conflict, to be decided`,
  corrected: (event) => `${step(event)}: the measurement by ${event.body.operator} was corrected${event.body.by ? ` by ${event.body.by}` : ""}${reason(event)}`,
  voided: (event) => `${step(event)}: the measurement by ${event.body.operator} is void${event.body.by ? `, says ${event.body.by}` : ""}${reason(event)}`,
  decided: (event) => `${step(event)}: ${event.body.by ? `${event.body.by} decided` : "decided"} about the answer by ${event.body.operator}${reason(event)}`,
  selected: (event) => `${step(event)}: selected a controller to try in reality`,
  measured: (event) => `${step(event)}: ${inReality("measured in reality,", event.body.fitness)}`,
  tuned: (event) => `${step(event)}: simulators tuned, sum of squared errors ${squaredError(event.body.squared_error)}`,
  transferred: (event) => `${step(event)}: controller evolved, ${reaching("reaching", event.body.simulated_fitness, " in simulation")}`,
  probed: (event) => event.body.left_out ? `${step(event)}: the controller is not measured, as the spec says` : `${step(event)}: ${inReality("the controller reaches", event.body.fitness, " in reality")}`,
};

/**
 * Return what an edit changed: tags by their names, where the event has them, and other fields.
 * @param {{ fields?: string[], tags?: string[], add_tags?: string[], remove_tags?: string[] }} body
 */
function edits({ fields = [], tags, add_tags: added, remove_tags: removed }) {
  const told = [[tags, "set the"], [added, "added the"], [removed, "removed the"]].flatMap(([names, did]) =>
    (names?.length ? [`${did} tag${names.length === 1 ? "" : "s"} ${/** @type {string[]} */ (names).join(", ")}`] : []));
  const others = told.length ? fields.filter((field) => !TAG_FIELDS.includes(field)) : fields;
  return [others.join(", ").replaceAll("_", " "), ...told].filter(Boolean).join("; ");
}

/** @param {{ channel?: string }} body */
const channel = ({ channel: name }) => `the ${String(name).replace("own_webhook", "webhook of its own").replace(/^webhook$/, "service's webhook")}`;

/** @param {number | null | undefined} value */
function squaredError(value) {
  if (value === null || value === undefined) return "unknown";
  return value && value < 0.001 ? value.toExponential(1) : number(value);
}

/** Every kind of event that has words here. */
export const KINDS = Object.keys(WORDS);

/** Return an event in words; a kind that is newer than this page is called by its name. @type {Words} */
export const eventText = (event) => (WORDS[event.kind] ?? (({ kind }) => kind.replaceAll("_", " ")))(event);
