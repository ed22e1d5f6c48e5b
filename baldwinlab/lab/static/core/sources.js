/** Lifetimes by study, condition, run and generation. */

import { createQuery, getJSON } from "./common.js";

// Instead of a study: the built-in presets.
export const PRESETS = "@presets";
// The number of links of a message about a missing lifetime.
const MAX_CHOICES = 12;

/**
 * @typedef {object} Source a lifetime of a live run, or of a study
 * @property {string} [live]
 * @property {string} [study]
 * @property {string} [condition]
 * @property {number} [run]
 * @property {number} [generation]
 */

/**
 * @typedef {{studies: object[], worldless: object[], unplayable: {study: string, reason:
 *   string}[]}} Stored the studies of `loadStudies`
 */

/**
 * Return the query of a lifetime for /api/recording and similar routes.
 * @param {Source} source
 */
export function createLifetimeQuery({ live, study, condition, run, generation }) {
  const stored = study === PRESETS ? { preset: condition } : { study, condition };
  return createQuery({ ...(live ? { live } : stored), run, generation });
}

/**
 * Return the address of a lifetime in the World tab.
 * @param {Source} life
 */
export function formatLifetimeAddress(life) {
  return `#/world?${createQuery(life)}`;
}

/** Return whether the World tab can show a condition: a world, alleles or views. */
export function isViewable({ steps, alleles, views }) {
  return Boolean(steps || alleles?.length || views?.length);
}

/** Return whether the nearest available lifetime has a world. */
export function hasWorld(studies, requested) {
  const { study, condition } = findNearestLifetime(studies, requested);
  return Boolean(
    studies.find(({ id }) => id === study).conditions.find(({ name }) => name === condition).steps,
  );
}

/** An address that names no lifetime. `choices` are the nearest addresses that exist. */
export class MissingLifetimeError extends Error {
  /**
   * @param {string} message
   * @param {{label: string, life: Partial<Source>}[]} choices
   */
  constructor(message, choices) {
    super(message);
    this.choices = choices;
  }
}

/**
 * Return the nearest available lifetime. With `strict`, throw MissingLifetimeError for an unknown
 * one.
 */
export function findNearestLifetime(
  studies,
  /** @type {Source} */ { study, condition, run, generation },
  strict = false,
) {
  const match = studies.find(({ id }) => id === study) ??
    (strict && study !== undefined ? null : studies[0]);
  if (!match)
    throw new MissingLifetimeError(
      `There is no study ${study} in this folder.`,
      listChoices("study", studies.map(({ id }) => id)),
    );
  const named = match.conditions.find(({ name }) => name === condition);
  if (strict && condition !== undefined && !named)
    throw new MissingLifetimeError(
      `The study ${match.id} has no finished runs of ${condition}.`,
      listChoices("condition", match.conditions.map(({ name }) => name), { study: match.id }),
    );
  const selected = named ?? match.conditions.find(({ shown }) => shown) ?? match.conditions[0];
  const last = selected.generations - 1;
  const requestedGeneration = Number(generation ?? last);
  if (strict) requireGenerationAndRun(match, selected, generation, run);
  return {
    study: match.id,
    condition: selected.name,
    run: selected.runs.includes(Number(run)) ? Number(run) : selected.runs[0],
    generation: Math.min(requestedGeneration, last),
  };
}

/** Throw MissingLifetimeError if a condition has no such generation or run. */
function requireGenerationAndRun(study, { name, generations, runs }, generation, run) {
  const base = { study: study.id, condition: name };
  const last = generations - 1;
  const number = Number(generation ?? last);
  if (!(Number.isInteger(number) && number >= 0 && number <= last))
    throw new MissingLifetimeError(
      `${name} has no generation ${generation}: its generations are 0 to ${last}.`,
      listChoices("generation", last ? [0, last] : [0], base),
    );
  if (run !== undefined && !runs.includes(Number(run)))
    throw new MissingLifetimeError(
      `The study ${study.id} has no run ${run} of ${name}.`,
      listChoices("run", runs, base),
    );
}

/** Return a choice per value of a part of a lifetime. */
function listChoices(part, values, base = {}) {
  const hasName = part === "study" || part === "condition";
  return values.slice(0, MAX_CHOICES).map((value) => ({
    label: hasName ? String(value) : `${part} ${value}`,
    life: { ...base, [part]: value },
  }));
}

/** Add the typical run to a state without a run. */
export async function addTypicalRun(studies, state) {
  if (state.run !== undefined) return state;
  const { study, condition } = findNearestLifetime(studies, state);
  if (study === PRESETS) return state;
  try {
    return {
      ...state,
      ...(await getJSON(`api/typical?${new URLSearchParams({ study, condition })}`)),
    };
  } catch {
    // The request of the lifetime reports the error.
    return state;
  }
}

/** Return whether two conditions are compared: on one map, under one variant, in one world. */
function sharesWorld(first, second) {
  return ["map", "variant", "world"].every((factor) => first[factor] === second?.[factor]);
}

/**
 * Return the lifetime to compare with: the main or next condition in the same world, or generation 0.
 */
export function chooseComparison({ source, conditions }) {
  const current = conditions.find(({ name }) => name === source.condition);
  const candidates = conditions.filter(
    (candidate) => candidate.steps && sharesWorld(candidate, current),
  );
  const first = conditions.find(({ shown }) => shown)?.learner;
  const alternative = candidates
    .filter(({ learner }) => learner === first)
    .concat(candidates)
    .find(
      (candidate) =>
        candidate !== current &&
        candidate.runs.includes(source.run) &&
        candidate.generations > source.generation,
    );
  return alternative
    ? { ...source, condition: alternative.name }
    : { ...source, generation: source.generation === 0 ? (current?.generations ?? 1) - 1 : 0 };
}

/** Return the study with the newest run, or undefined without a study. */
export function findNewest(studies) {
  const modified = (study) => study.modified ?? 0;
  return studies.toSorted((first, second) => modified(second) - modified(first))[0];
}

/**
 * Return the state of a page that opens without an address: the newest study, and agents that learn
 * next to agents that do not.
 */
export function chooseOpening(studies) {
  const newest = findNewest(studies);
  const source = findNearestLifetime([newest], {});
  const { study, condition } = source;
  const first = newest.conditions.find(({ name }) => name === condition);
  if (!first.steps) return { study, condition };
  const second = newest.conditions.find(
    (candidate) =>
      candidate.steps &&
      sharesWorld(candidate, first) &&
      candidate.learns !== first.learns &&
      first.runs.every((run) => candidate.runs.includes(run)),
  );
  if (!second) return { study, condition };
  return {
    study,
    condition: first.learns ? condition : second.name,
    "b.condition": first.learns ? second.name : condition,
  };
}

/**
 * Load the viewable studies, or the built-in presets if there are none.
 *
 * `worldless` are the stored conditions that cannot be shown. `unplayable` are the studies that
 * cannot be read or simulated, with the reason.
 */
export async function loadStudies() {
  const { studies: all } = await getJSON("api/studies");
  const findReason = ({ problem, missing }) => problem || missing;
  const unplayable = all
    .filter(findReason)
    .map((study) => ({ study: study.id, reason: findReason(study) }));
  const studies = all.filter((study) => !findReason(study));
  const worldless = studies.flatMap(({ id, conditions }) =>
    conditions
      .filter((stored) => !isViewable(stored))
      .map(({ name }) => ({ study: id, condition: name }))
  );
  const stored = studies
    .map((study) => ({
      ...study,
      conditions: study.conditions.filter((stored) => stored.runs.length && isViewable(stored)),
    }))
    .filter(({ conditions }) => conditions.length);
  return { studies: stored.length ? stored : [await loadPresets()], worldless, unplayable };
}

/** Throw MissingLifetimeError if the address names a study or condition that cannot be shown. */
export function requireViewable({ studies, worldless, unplayable }, state) {
  const fault = unplayable.find(({ study }) => study === state.study);
  if (fault)
    throw new MissingLifetimeError(
      `${fault.study}: ${fault.reason}`,
      listChoices("study", studies.map(({ id }) => id)),
    );
  const match = worldless.find(
    ({ study, condition }) => study === state.study && condition === (state.condition ?? condition),
  );
  if (match && (state.condition || studies.every(({ id }) => id !== state.study)))
    throw new MissingLifetimeError(
      `The model of ${match.condition} in ${state.study} has no world to show.`,
      listChoices("study", studies.map(({ id }) => id)),
    );
}

/**
 * Return the full name of a lifetime.
 * @param {Source} source
 */
export function formatLifetimeTitle({ study, condition, run, generation }) {
  const name = study === "." ? "this study" : `the study ${study}`;
  const suffix = study === PRESETS ? "" : `, of ${name}`;
  return `${condition}, run ${run}, generation ${generation}${suffix}`;
}

async function loadPresets() {
  const { presets } = await getJSON("api/presets");
  const runs = Array.from({ length: 10 }, (_, run) => run);
  return {
    id: PRESETS,
    conditions: presets
      .filter(({ world }) => world)
      .map(({ world, ...preset }) => ({ ...preset, ...world, title: preset.name, runs })),
  };
}
