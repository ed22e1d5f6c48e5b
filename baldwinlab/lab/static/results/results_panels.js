/** The panels of the curves: one for each map if the bands of many conditions would overlap. */

// More conditions on several maps have a panel for each map.
const MAX_SHARED_CURVES = 3;

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
