/** Earlier live runs of this page, for comparison, and names that state what was changed. */

import { getJSON } from "../core/common.js";
import { findChanges } from "../core/experiment_changes.js";

const MAX_RUNS = 3;
const MAX_NAMED_CHANGES = 3;

/** @type {{name: string, values: number[]}[]} the most recent run is the last */
const earlier = [];

/** Return the most recent runs, with the mean of the average agent in each generation. */
export function listEarlierRuns() {
  return [...earlier];
}

/** Remember the curve of a run that the page no longer shows. */
export function rememberRun(name, values) {
  if (!values.length) return;
  const previous = earlier.findIndex((run) => run.name === name);
  // The same settings with the same seed give the same curve.
  if (previous >= 0) earlier.splice(previous, 1);
  earlier.push({ name, values });
  if (earlier.length > MAX_RUNS) earlier.shift();
}

/**
 * Return the name of an experiment with its changes, for example "evo+self-taught/A, rule: none".
 * @param {Object<string, any>} experiment
 */
export async function nameExperiment(experiment) {
  const { name } = experiment;
  const { presets } = await getJSON("api/presets");
  // The user has given it another name.
  if (!presets.some((preset) => preset.name === name)) return name;
  const base = await getJSON(`api/preset?${new URLSearchParams({ name })}`);
  const changes = Object.entries(findChanges(experiment, base));
  const parts = changes.slice(0, MAX_NAMED_CHANGES).map(([path, value]) => describe(path, value));
  const rest = changes.length - parts.length;
  return [name, ...parts, ...(rest > 0 ? [`${rest} more changes`] : [])].join(", ");
}

function describe(path, value) {
  const label = path.split(".").at(-1).replaceAll("_", " ");
  return `${label}: ${typeof value === "object" ? "changed" : value}`;
}
