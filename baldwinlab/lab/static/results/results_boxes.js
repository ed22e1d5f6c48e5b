/** The final values of all runs, as box plots. */

import { drawBoxChart } from "../charts/box_chart.js";
import { selectSeriesStyle } from "../charts/chart_series.js";
import { el } from "../core/common.js";
import { createChartDownloads } from "../core/downloads.js";
import { findLastLifetime, findRuns, hasWorldView } from "./results_measures.js";
import { formatLifetimeAddress } from "../core/sources.js";

const CSV_COLUMNS = ["box", "condition", "run", "value"];

/**
 * Draw the final values of a measure, with downloads.
 * @param {HTMLElement} root is filled
 * @param {import("./view_results.js").ResultsState} view
 * @param {"best"|"mean"} measure
 * @returns {{destroy: () => void}}
 */
export function drawBoxes(root, view, measure) {
  const { name, axis } = view.results.measures[measure];
  const boxes = view.groups.map((group) => createBox(view, measure, group));
  const plot = el("div");
  const chart = drawBoxChart(plot, {
    title: `${name} at the end of each run, ${axis}`,
    groups: boxes,
    height: 320,
  });
  root.append(plot);
  // The report has no boxes of several conditions.
  if (!hasReportBoxes(view)) {
    const rows = () =>
      boxes.flatMap(({ label, points }) => points.map((point) => ({ box: label, ...point })));
    root.append(createChartDownloads(`final-${measure}`, CSV_COLUMNS, rows));
  }
  return chart;
}

/** Return whether the report has a figure with the same boxes. */
export function hasReportBoxes({ hasSingleConditions, results }) {
  return hasSingleConditions && !results.swept;
}

/** Return the box of a group. Its points link to lifetimes if the conditions have a world. */
function createBox(view, measure, { label, conditions, style }) {
  const points = listPoints(view, measure, conditions);
  const { axis } = view.results.measures[measure];
  const describe = (index) => {
    const { condition, run, value } = points[index];
    return `${condition}, run ${run}: ${value.toFixed(1)} ${axis}`;
  };
  const box = {
    label,
    points,
    values: points.map(({ value }) => value),
    color: selectSeriesStyle(style).color,
    describe,
  };
  if (!hasWorldView(view, conditions[0])) return box;
  const href = (index) => {
    const { condition, run } = points[index];
    return formatLifetimeAddress(findLastLifetime(view, condition, run));
  };
  return { ...box, targetText: "Open the last generation.", href };
}

/** Return the final value of each run. */
function listPoints({ study, results }, measure, conditions) {
  return conditions.flatMap((condition) =>
    findRuns(study, condition).map((run, index) => ({
      condition,
      run,
      value: results.final[condition][measure][index],
    }))
  );
}
