/** Events in words for people. */

import { count, number } from "../../lib/format.js";

const of = ({ repetition }) => `Repetition ${repetition}`;
const at = ({ repetition, body }) => `Repetition ${repetition}, iteration ${body.iteration}`;
const why = ({ body }) => (body.reason ? `: ${body.reason}` : "");
const fitness = (value) => (value === null || value === undefined ? "physics failed" : number(value));

const WORDS = {
  submitted: ({ body }) => `Submitted, with ${count(body.repetitions)} repetitions`,
  imported: () => "Imported from an archive",
  started: () => "Started",
  pausing: () => "Pausing: steps under way are finished",
  paused: () => "Paused",
  resumed: () => "Resumed",
  stopping: () => "Stopping: steps under way are finished",
  extended: ({ body }) => `Extended to ${count(body.iterations)} iterations, ${count(body.repetitions)} repetitions`,
  completed: () => "Completed",
  failed: () => "Failed",
  cancelled: () => "Cancelled",
  sensitivity_ended: ({ body }) =>
    `Sensitivity check ${String(body.state).toLowerCase()}${body.warnings?.length ? `: ${body.warnings.join(" ")}` : ""}`,
  versions_refused: ({ body }) => `Left alone by a supervisor with other versions: ${body.refused_by}, not ${body.computed_with}`,
  versions_accepted: () => "Goes on under other versions, as was asked",
  repetition_claimed: (event) => `${of(event)} ${event.body.steps ? `goes on after ${count(event.body.steps)} steps` : "begins"}`,
  repetition_completed: (event) => `${of(event)} completed`,
  repetition_failed: (event) => `${of(event)} failed${why(event)}`,
  repetition_lost: (event) => `${of(event)} lost its worker, and is queued again${why(event)}`,
  repetition_handed_back: (event) => `${of(event)} handed back${why(event)}`,
  repetition_paused: (event) => `${of(event)} paused`,
  repetition_stopped: (event) => `${of(event)} stopped`,
  repetition_cancelled: (event) => `${of(event)} cancelled`,
  selected: (event) => `${at(event)}: chose what to try in reality`,
  measured: (event) => `${at(event)}: measured in reality, ${fitness(event.body.fitness)}`,
  tuned: (event) => `${at(event)}: simulators tuned, squared error ${error(event.body.squared_error)}`,
  transferred: (event) => `${at(event)}: controller evolved, ${fitness(event.body.simulated_fitness)} in simulation`,
  probed: (event) => `${at(event)}: the controller reaches ${fitness(event.body.fitness)} in reality`,
};

function error(value) {
  return value === null || value === undefined ? "unknown" : value && value < 0.001 ? value.toExponential(1) : number(value);
}

/** Every kind of event that there are words for. */
export const KINDS = Object.keys(WORDS);

/** What happened; a kind that is newer than this page has its name. */
export const words = (event) => (WORDS[event.kind] ?? (({ kind }) => kind.replaceAll("_", " ")))(event);
