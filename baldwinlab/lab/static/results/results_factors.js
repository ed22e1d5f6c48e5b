/** The factors of conditions: filter conditions, group them into curves, and divide the curves. */

import { createField, createSelect, el } from "../core/common.js";
import { computeMean } from "../charts/quantiles.js";

// With more curves, conditions are grouped by default.
const MAX_CURVES = 8;
// In the address: one curve per condition.
const PER_CONDITION = "each";
// More conditions on several maps have a panel for each map.
const MAX_SHARED_CURVES = 3;

/**
 * Return the groups of conditions that the address selects.
 * @param {object} results `factors` contains a value per condition; `swept` is true for a sweep,
 *   whose names are not informative
 * @param {Object<string, string>} state `group` is a factor, `only.FACTOR` a value of it
 * @returns {{by: string|null, only: Object<string, string>, groups: {label: string, conditions:
 *   string[]}[]}}
 */
export function groupConditions({ conditions, factors, swept }, state) {
  const only = Object.fromEntries(
    Object.keys(factors).map((factor) => [factor, state[`only.${factor}`] ?? ""]),
  );
  const matches = (number) =>
    Object.entries(only).every(
      ([factor, value]) => !value || String(factors[factor][number]) === value,
    );
  const matching = conditions.map((_, number) => number).filter(matches);
  const values = (factor) => [
    ...new Set(matching.map((number) => String(factors[factor][number]))),
  ];
  const varying = Object.keys(factors).filter((factor) => values(factor).length > 1);
  const defaultFactor = swept || matching.length > MAX_CURVES
    ? (varying.find((factor) => values(factor).length <= MAX_CURVES) ?? varying[0])
    : undefined;
  const by = chooseFactor(state.group, varying, defaultFactor);
  const groups = by
    ? values(by).map((value) => ({
      label: value,
      conditions: matching
        .filter((number) => String(factors[by][number]) === value)
        .map((number) => conditions[number]),
    }))
    : matching.map((number) => ({ label: conditions[number], conditions: [conditions[number]] }));
  return { by, only, groups };
}

/** Return the factor that groups conditions, or null for one curve per condition. */
function chooseFactor(requested, varying, defaultFactor) {
  if (varying.includes(requested)) return requested;
  return requested === PER_CONDITION ? null : (defaultFactor ?? null);
}

/**
 * @typedef {object} Group one curve
 * @property {string} label
 * @property {string[]} conditions
 * @property {number} style index of its color and dash
 */

/**
 * Return the panels of the curves. A learner has one style on all maps, as in the report.
 * @param {object} results of /api/results
 * @param {{label: string, conditions: string[]}[]} groups
 * @returns {{map: string, groups: Group[]}[]}
 */
export function createPanels(results, groups) {
  const shared = [{ map: "", groups: groups.map((group, style) => ({ ...group, style })) }];
  const { map: maps, learner: learners } = results.factors;
  const hasGroupedConditions = groups.some(({ conditions }) => conditions.length > 1);
  if (!maps || !learners || hasGroupedConditions || groups.length <= MAX_SHARED_CURVES)
    return shared;
  const shownLearners = new Set();
  const panels = new Map();
  for (const group of groups) {
    const index = results.conditions.indexOf(group.conditions[0]);
    shownLearners.add(learners[index]);
    const style = [...shownLearners].indexOf(learners[index]);
    panels.set(maps[index], [...(panels.get(maps[index]) ?? []), { ...group, style }]);
  }
  if (panels.size < 2) return shared;
  return [...panels].map(([map, members]) => ({ map, groups: members }));
}

/** Return a map in a sentence: "A" -> "map A", "your map" -> "your map". */
export function describeMap(name) {
  return name.startsWith("your map") ? name : `map ${name}`;
}

/** Combine the curves of several conditions: the mean of their medians, and the range. */
export function combineCurves(curves) {
  if (curves.length === 1) return curves[0];
  const combine = (aggregate) =>
    curves[0].center.map((_, index) => {
      const present = curves.map((curve) => curve.center[index]).filter((value) => value !== null);
      return present.length ? aggregate(present) : null;
    });
  return {
    center: combine(computeMean),
    low: combine((values) => Math.min(...values)),
    high: combine((values) => Math.max(...values)),
  };
}

/** Return the lists that filter by each factor, and the list that groups by a factor. */
export function createFactorLists({ factors }, { by, only }, choose) {
  const names = Object.keys(factors);
  if (!names.length) return null;
  const filters = names.map((factor) =>
    createList(
      factor,
      [["", "all"], ...[...new Set(factors[factor].map(String))].map((value) => [value, value])],
      only[factor],
      (value) => choose({ [`only.${factor}`]: value, hidden: null }),
      `only-${factor}`,
    )
  );
  const grouped = createList(
    "one curve per",
    [[PER_CONDITION, "condition"], ...names.map((name) => [name, name])],
    by ?? PER_CONDITION,
    (value) => choose({ group: value, hidden: null }),
    "group",
  );
  return el("div", { class: "row results-factors" }, ...filters, grouped);
}

function createList(name, options, selectedValue, change, id) {
  return createField(name, createSelect(options, selectedValue, change, { "data-testid": id }));
}

/** Return the state that another study resets. */
export function clearFactorState(results) {
  return {
    group: null,
    hidden: null,
    ...Object.fromEntries(
      Object.keys(results?.factors ?? {}).map((factor) => [`only.${factor}`, null]),
    ),
  };
}
