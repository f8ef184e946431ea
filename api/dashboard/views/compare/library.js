/** What is known of the experiments and studies that are chosen or found. */

import { get } from "../../lib/api.js";
import { spoken } from "../../lib/format.js";

const GONE = 404;

/** Experiments by id; each is fetched once, those of a study together. */
export function library(signal) {
  const experiments = new Map();
  const studies = new Map();

  const keep = (found) => experiments.set(found.id, found);

  /** The ids of a study's experiments; none if there is no such study. */
  async function study(id) {
    const found = await orNothing(get(`/studies/${id}`, {}, signal));
    if (!found) return [];
    shelve(found);
    return found.experiments.map((each) => each.id);
  }

  function shelve(found) {
    studies.set(found.id, found.name);
    found.experiments.forEach(keep);
  }

  async function anew(ids) {
    const found = await Promise.all(ids.map((id) => orNothing(get(`/experiments/${id}`, {}, signal))));
    ids.forEach((id, at) => experiments.set(id, found[at]));
  }

  /** Look up those that are not known yet, and the studies that they are of. */
  async function fetch(ids) {
    for (let left = unknown(ids); left.length; left = unknown(ids)) {
      await anew(left.slice(0, 1));
      const of = experiments.get(left[0])?.study;
      await (of ? study(of) : anew(left.slice(1)));
    }
    const places = new Set(ids.map((id) => experiments.get(id)?.study).filter((each) => each && !studies.has(each)));
    await Promise.all([...places].map(study));
  }

  const unknown = (ids) => ids.filter((id) => !experiments.has(id));

  return {
    /** An experiment; nothing if there is none of that id. */
    get: (id) => experiments.get(id) ?? null,
    isMissing: (id) => experiments.has(id) && !experiments.get(id),
    keep, shelve, study, anew, fetch,
    name: (id) => spoken(experiments.get(id)?.name ?? id),
    /** Their names by id, as the figure has them: of two that are alike each carries its id. */
    names(ids) {
      const names = ids.map(this.name);
      const alone = (name) => names.indexOf(name) === names.lastIndexOf(name);
      return new Map(ids.map((id, at) => [id, alone(names[at]) ? names[at] : `${names[at]} (${id.slice(0, 8)})`]));
    },
    place: (id) => studies.get(experiments.get(id)?.study) ?? null,
  };
}

/** What was asked for, or nothing if it is not there. */
async function orNothing(asked) {
  try {
    return await asked;
  } catch (error) {
    if (error.status === GONE) return null;
    throw error;
  }
}
