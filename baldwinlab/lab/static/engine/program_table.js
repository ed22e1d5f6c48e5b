/** The compiled modules of a page, and the appearance of its worlds. */

import { lookUp } from "./engine.js";

/**
 * @typedef {object} Program a compiled module of a page
 * @property {string} name
 * @property {Object<string, any>} when the settings that select it
 */

/**
 * Return the compiled module for an experiment, or undefined if the page does not contain it.
 * @param {Program[]} programs
 */
export function matchProgram(programs, experiment) {
  return programs.find(({ when }) =>
    Object.entries(when).every(([path, value]) => isEqual(lookUp(experiment, path), value))
  );
}

/**
 * Return the compiled module for an experiment. Throw an Error if the page does not contain it.
 * @param {Program[]} programs
 * @returns {Program}
 */
export function findProgram(programs, experiment) {
  const program = matchProgram(programs, experiment);
  if (!program)
    throw new Error(
      "This page has no compiled module for the parts of this experiment. Export the " +
        "page again with these parts.",
    );
  return program;
}

/** Fill a template: replace each {"path"} by its value, and each "table" by one row per entry. */
export function fillTemplate(template, experiment) {
  if (Array.isArray(template)) {
    return template.flatMap((item) =>
      item?.table
        ? lookUp(experiment, item.table).map((row) => fillTemplate(item.row, row))
        : [fillTemplate(item, experiment)]
    );
  }
  if (!isTable(template)) return template;
  if ("path" in template)
    return (
      lookUp(experiment, template.path) - (template.less ? lookUp(experiment, template.less) : 0)
    );
  if ("sum" in template)
    return template.sum.reduce((sum, [path, factor]) => sum + factor * lookUp(experiment, path), 0);
  return Object.fromEntries(
    Object.entries(template).map(([name, value]) => [name, fillTemplate(value, experiment)]),
  );
}

/** Return the header of a recording that a worker has made. */
export function createRecordingHeader(experiment, appearance, { part, arrays }, generation) {
  return {
    generation,
    ...part,
    steps: experiment.lifetime.steps,
    agents: experiment.population.size,
    items: arrays.item_x.length,
    world: experiment.world,
    appearance,
    learns: experiment.learning.rule !== "none",
  };
}

export function isTable(value) {
  return value !== null && typeof value === "object" && !Array.isArray(value);
}

function isEqual(first, second) {
  return JSON.stringify(first) === JSON.stringify(second);
}
