/** The measures of a study: their names, runs, and last generations. */

import { isViewable } from "./sources.js";

const WITHOUT_FOOD = {
  best: { name: "Best agent", axis: "fitness", title: "Fitness of the best agent" },
  mean: { name: "Average agent", axis: "fitness", title: "Fitness of the average agent" },
  share: {
    name: "Share above 0",
    axis: "share of the agents",
    title: "Share of agents with fitness above 0",
  },
};

// For foragers, fitness is the energy of the eaten items.
export const MEASURES = {
  best: { ...WITHOUT_FOOD.best, axis: "fitness (energy)" },
  mean: { ...WITHOUT_FOOD.mean, axis: "fitness (energy)" },
  share: {
    name: "Share that eats",
    axis: "share of the agents",
    title: "Share of agents that eat",
  },
};

/** Return the labels of the measures of a study. */
export function describeMeasures(results) {
  return results.food ? MEASURES : WITHOUT_FOOD;
}

export function findRuns(study, name) {
  return study.conditions.find((condition) => condition.name === name).runs;
}

/** Return whether the World tab can show a condition, or any condition. */
export function hasWorldView({ study }, label) {
  return study.conditions.some(
    (condition) => isViewable(condition) && (label === undefined || condition.name === label),
  );
}

/** Return a function that returns the last generation of a condition. */
export function createGenerationLookup(results) {
  return (condition) => {
    const mean = results.curves[condition].best.mean;
    return results.generation[mean.findLastIndex((value) => value !== null)];
  };
}
