// @ts-check
/** The experiments and studies that are chosen or found, each loaded once. */

import { get } from "../../lib/api.js";
import { titleOf } from "../../lib/format.js";

const OF_STUDY = 40;  // characters, as in figures
const NOT_FOUND = 404;

/**
 * Return an empty cache, which loads until `signal`.
 *
 * @param {AbortSignal} signal
 */
export function experimentCache(signal) {
  /** @type {Map<string, Api.ExperimentRead | null>} */
  const experiments = new Map();
  /** @type {Map<string, string>} */
  const studyNames = new Map();

  /** @param {Api.StudyRead} study */
  function addStudy(study) {
    studyNames.set(study.id, study.name);
    for (const experiment of study.experiments) experiments.set(experiment.id, experiment);
  }

  /**
   * Load a study, and return the ids of its experiments; none if there is no such study.
   *
   * @param {string} id
   */
  async function loadStudy(id) {
    /** @type {Api.StudyRead | null} */
    const study = await orNull(get(`/studies/${id}`, {}, signal));
    if (study) addStudy(study);
    return study?.experiments.map((experiment) => experiment.id) ?? [];
  }

  /**
   * Load experiments, also those that are known.
   *
   * @param {string[]} ids
   */
  async function reload(ids) {
    const loaded = await Promise.all(ids.map((id) => orNull(get(`/experiments/${id}`, {}, signal))));
    ids.forEach((id, index) => experiments.set(id, loaded[index]));
  }

  /**
   * Load the experiments that are not known yet, and the studies that they belong to.
   *
   * @param {string[]} ids
   */
  async function load(ids) {
    const unknown = () => ids.filter((id) => !experiments.has(id));
    for (let left = unknown(); left.length; left = unknown()) {
      await reload(left.slice(0, 1));
      const study = experiments.get(left[0])?.study;
      await (study ? loadStudy(study) : reload(left.slice(1)));
    }
    const studies = new Set(ids.map((id) => experiments.get(id)?.study));
    await Promise.all([...studies].map((study) => (study && !studyNames.has(study) ? loadStudy(study) : null)));
  }

  /** @param {string} id */
  const nameOf = (id) => titleOf(experiments.get(id) ?? { name: id, strategy: "" });

  return {
    addStudy, loadStudy, reload, load, nameOf,
    /** @param {string} id of an experiment; null if it is not known, or there is none */
    get: (id) => experiments.get(id) ?? null,
    /** @param {string} id of an experiment that does not exist */
    isMissing: (id) => experiments.get(id) === null,
    /** @param {string} id of an experiment whose study is named; null if it is the only one of its study */
    studyName: (id) => (experiments.get(id)?.study === id ? null : studyNames.get(experiments.get(id)?.study ?? "") ?? null),
    /**
     * Return names by id, as the figure has them: names that are alike are followed by those of their studies, and then by their ids.
     *
     * @param {string[]} ids
     */
    namesOf(ids) {
      const studies = ids.map((id) => studyNames.get(experiments.get(id)?.study ?? "") ?? "");
      const areSeveral = new Set(studies).size > 1;
      const short = distinct(ids.map(nameOf), (name, index) => {
        const hasOther = areSeveral && studies[index] && studies[index] !== experiments.get(ids[index])?.name;
        return hasOther ? `${name} · ${cut(studies[index])}` : name;
      });
      const names = distinct(short, (name, index) => `${name} (${ids[index].slice(0, 8)})`);
      return new Map(ids.map((id, index) => [id, names[index]]));
    },
    /**
     * Return the chosen experiments that exist.
     *
     * @param {string[]} ids
     */
    known: (ids) => ids.filter((id) => experiments.get(id)),
  };
}

/** Return names, those that are alike with an addition. @param {string[]} names @param {(name: string, index: number) => string} add */
const distinct = (names, add) => names.map((name, index) => (names.indexOf(name) === names.lastIndexOf(name) ? name : add(name, index)));

/** @param {string} name */
const cut = (name) => (name.length > OF_STUDY ? `${name.slice(0, OF_STUDY - 1)}…` : name);

/**
 * Return what a request answers; null if there is no such thing.
 *
 * @param {Promise<any>} request
 */
async function orNull(request) {
  try {
    return await request;
  } catch (error) {
    if (error.status === NOT_FOUND) return null;
    throw error;
  }
}
