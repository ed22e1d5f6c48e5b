/** Conditions by what tells them apart: which of them are shown, and which are drawn together as one curve. */

import { el } from "./common.js";

const MANY = 8; // curves beyond which conditions are drawn together unless the reader wants each
const EACH = "each"; // in the address: every condition by itself

/**
 * What the address asks for.
 * @param {object} results its `factors` have a value for each of its `conditions`; whether it is `swept`, for names of points say nothing
 * @param {Object<string, string>} state `group` names a factor, `only.FACTOR` a value of it
 * @returns {{by: string|null, only: Object<string, string>, groups: {label: string, conditions: string[]}[]}}
 */
export function groupConditions({ conditions, factors, swept }, state) {
  const only = Object.fromEntries(
    Object.keys(factors).map((factor) => [factor, state[`only.${factor}`] ?? ""]),
  );
  const matches = (number) =>
    Object.entries(only).every(
      ([factor, value]) => !value || String(factors[factor][number]) === value,
    );
  const shown = conditions.map((_, number) => number).filter(matches);
  const values = (factor) => [...new Set(shown.map((number) => String(factors[factor][number])))];
  const varying = Object.keys(factors).filter((factor) => values(factor).length > 1);
  const defaultFactor =
    swept || shown.length > MANY
      ? (varying.find((factor) => values(factor).length <= MANY) ?? varying[0])
      : undefined;
  const by = varying.includes(state.group)
    ? state.group
    : state.group === EACH
      ? null
      : (defaultFactor ?? null);
  const groups = by
    ? values(by).map((value) => ({
        label: value,
        conditions: shown
          .filter((number) => String(factors[by][number]) === value)
          .map((number) => conditions[number]),
      }))
    : shown.map((number) => ({ label: conditions[number], conditions: [conditions[number]] }));
  return { by, only, groups };
}

/** One curve of several conditions: the mean of theirs, and from the lowest of them to the highest. */
export function combineCurves(curves) {
  if (curves.length === 1) return curves[0];
  const combine = (choose) =>
    curves[0].mean.map((_, index) => {
      const present = curves.map((curve) => curve.mean[index]).filter((value) => value !== null);
      return present.length ? choose(present) : null;
    });
  return {
    mean: combine((values) => values.reduce((sum, value) => sum + value, 0) / values.length),
    low: combine((values) => Math.min(...values)),
    high: combine((values) => Math.max(...values)),
  };
}

/** Lists to choose from: a value of each factor, and the factor by which conditions are drawn together. */
export function factorChoices({ factors }, { by, only }, choose) {
  const names = Object.keys(factors);
  if (!names.length) return null;
  const filters = names.map((factor) =>
    selectList(
      factor,
      [["", "all"], ...[...new Set(factors[factor].map(String))].map((value) => [value, value])],
      only[factor],
      (value) => choose({ [`only.${factor}`]: value, hidden: null }),
      `only-${factor}`,
    ),
  );
  const grouped = selectList(
    "one curve per",
    [[EACH, "condition"], ...names.map((name) => [name, name])],
    by ?? EACH,
    (value) => choose({ group: value, hidden: null }),
    "group",
  );
  return el("div", { class: "row results-factors" }, ...filters, grouped);
}

function selectList(name, options, chosen, change, id) {
  const entries = options.map(([value, text]) =>
    el("option", { value, selected: value === chosen }, text),
  );
  return el(
    "label",
    { class: "field" },
    el("span", {}, name),
    el(
      "select",
      { "data-testid": id, onchange: (event) => change(event.target.value) },
      ...entries,
    ),
  );
}

/** What a new study forgets of the one before. */
export function clearedState(results) {
  return {
    group: null,
    hidden: null,
    ...Object.fromEntries(
      Object.keys(results?.factors ?? {}).map((factor) => [`only.${factor}`, null]),
    ),
  };
}
