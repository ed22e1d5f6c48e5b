/** Reaction norms: fitness of the last generation when one setting differs from evolution. */

import { selectSeriesStyle } from "../charts/chart_series.js";
import { addChart } from "../charts/charts.js";
import { createCommandHint, createField, createSelect, el } from "../core/common.js";

const EXPLANATION =
  "Each curve shows the fitness of the last generation when one setting differs from its " +
  "value during evolution. Parentheses mark the value during evolution. Lines are " +
  "medians over runs. Bands are 95 % intervals, shown for six runs or more.";

/**
 * Draw the reaction norms into a section, as soon as they are loaded.
 * @param {HTMLElement} section
 * @param {Promise<{unit: string, panels: object[]}>} response of /api/results/reaction
 * @param {string} argument the study as the argument of a command
 * @param {import("./results_factors.js").Group[]} groups the visible groups
 * @param {string|undefined} field the changed setting, from the address
 * @param {(patch: Object<string, any>) => void} choose
 * @returns {{destroy: () => void}}
 */
export function createReactionNorms(section, response, argument, groups, field, choose) {
  let charts = [];
  let isDestroyed = false;
  const fill = (response) => {
    if (!isDestroyed)
      charts = response.panels.length
        ? showCharts(section, response, groups, field, choose)
        : showMissing(section, argument);
  };
  response.then(fill).catch((error) => section.append(el("p", { class: "soft" }, error.message)));
  return {
    destroy() {
      isDestroyed = true;
      for (const chart of charts) chart.destroy();
    },
  };
}

function showMissing(section, argument) {
  const hint = "The reaction norms of this study are not measured yet.";
  section.append(createCommandHint(hint, `baldwinlab assay ${argument} --assays reaction`));
  return [];
}

function showCharts(section, { unit, panels }, groups, field, choose) {
  const conditions = new Set(groups.flatMap((group) => group.conditions));
  const matching = panels.filter(({ norms }) =>
    Object.keys(norms).some((name) => conditions.has(name))
  );
  if (!matching.length) {
    section.append(
      el("p", { class: "soft" }, "Reaction norms are not measured for the conditions shown."),
    );
    return [];
  }
  const names = new Map(matching.map((panel) => [panel.field, panel.name]));
  const selectedField = names.has(field) ? field : matching[0].field;
  const picker = createSelect([...names], selectedField, (norm) => choose({ norm }), {
    "data-testid": "norm",
  });
  const containers = matching
    .filter((panel) => panel.field === selectedField)
    .map((panel) => [panel, el("div")]);
  section.append(
    el("p", { class: "soft" }, EXPLANATION),
    el("div", { class: "norm-field" }, createField("changed setting", picker)),
    el(
      "div",
      { class: containers.length > 1 ? "results-boxes" : "results-boxes wide" },
      ...containers.map(([, container]) => container),
    ),
  );
  return containers.map(([panel, container]) =>
    createChart(container, panel, unit, conditions, groups)
  );
}

/** Draw the curves of one changed setting on one map. */
function createChart(
  container,
  { field, name, map, values, evolved, norms },
  unit,
  conditions,
  groups,
) {
  const series = Object.entries(norms)
    .filter(([condition]) => conditions.has(condition))
    .map(([label, { median, low, high }]) => ({ label, values: median, low, high }));
  const curveIndices = series.map(({ label }) =>
    groups.findIndex((group) => group.conditions.length === 1 && group.conditions[0] === label)
  );
  // Use the styles of the curves above, if each condition has its own curve.
  const styles = curveIndices.includes(-1)
    ? [...series.keys()]
    : curveIndices.map((index) => groups[index].style);
  series.forEach((line, number) => Object.assign(line, selectSeriesStyle(styles[number])));
  const names = values.map((value) => (evolved.includes(value) ? `(${value})` : value));
  const options = {
    title: map ? `Evolved on map ${map}: ${unit} by ${name}` : `By ${name}: ${unit}`,
    x: values.map((_, index) => index),
    names,
    xLabel: name,
    yLabel: unit,
    series,
    height: 220,
  };
  const rows = () =>
    series.flatMap((line) =>
      values.map((value, index) => ({
        condition: line.label,
        value,
        median: line.values[index],
        low: line.low[index],
        high: line.high[index],
      }))
    );
  const columns = ["condition", "value", "median", "low", "high"];
  return addChart(container, options, {
    name: `reaction-${field}${map && `-${map.replaceAll(" ", "-")}`}`,
    columns,
    rows,
  });
}
