/** The measures of a study, its runs, and its last generations. */

import { isViewable } from "../core/sources.js";

// The measures of a study. The server names them.
export const MEASURES = ["mean", "best", "share"];

export function findRuns(study, name) {
  return study.conditions.find((condition) => condition.name === name).runs;
}

/** Return whether the World tab can show a condition, or any condition. */
export function hasWorldView({ study }, label) {
  return study.conditions.some(
    (condition) => isViewable(condition) && (label === undefined || condition.name === label),
  );
}

/** Return the lifetime of the last generation of a run. */
export function findLastLifetime({ study, results }, condition, run) {
  const mean = results.curves[condition].best.mean;
  const generation = results.generation[mean.findLastIndex((value) => value !== null)];
  return { study: study.id, condition, run, generation };
}
