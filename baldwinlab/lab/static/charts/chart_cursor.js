/** The cursor of a chart: clicks, keys, and the text of the current position. */

import { collectCurves } from "./chart_series.js";
import { formatDecimals } from "../core/common.js";

// The word before the number of a run.
export const RUN_LABEL = "run";

/** Call `onPick` for a click on a curve. */
export function bindPick(chart, currentSeries, onPick) {
  if (!onPick) return;
  chart.over.style.cursor = "pointer";
  chart.over.addEventListener("click", (event) => {
    const element = chart.over.getBoundingClientRect();
    const index = chart.posToIdx(event.clientX - element.left);
    const [nearest] = findVisibleCurves(chart, currentSeries(), index).sort(
      (first, second) =>
        computeDistance(first, event, element) - computeDistance(second, event, element),
    );
    if (nearest) onPick(describePick(chart, index, nearest));
  });
}

function computeDistance({ top }, event, element) {
  return Math.abs(top - (event.clientY - element.top));
}

/** Return the visible curves with a value at an index of the x axis, and their heights. */
function findVisibleCurves(chart, series, index) {
  return collectCurves(series)
    .map((curve) => ({ ...curve, value: curve.values[index] }))
    .filter(({ columns: [column], value }) => chart.series[column].show && value != null)
    .map((curve) => ({ ...curve, top: chart.valToPos(curve.value, "y") }));
}

export function describePick(chart, index, { label, run }) {
  return { index, x: chart.data[0][index], label, ...(run !== undefined && { run }) };
}

export function setCursor(chart, index, top = 0) {
  const left = index == null ? -10 : chart.valToPos(chart.data[0][index], "x");
  chart.setCursor({ left, top: index == null ? -10 : top });
}

/**
 * Return the target of a key, or null: left and right move along the x axis, up and down between
 * curves.
 */
export function readKey({ key }, chart, series, selectedColumn) {
  const last = chart.data[0].length - 1;
  const current = chart.cursor.idx ?? last;
  const target = {
    ArrowLeft: current - 1,
    ArrowRight: current + 1,
    PageUp: current - 10,
    PageDown: current + 10,
    Home: 0,
    End: last,
    ArrowUp: current,
    ArrowDown: current,
    Enter: current,
  }[key];
  if (target === undefined) return null;
  const index = Math.min(Math.max(target, 0), last);
  const curves = findVisibleCurves(chart, series, index);
  const previous = curves.find(({ columns: [column] }) => column === selectedColumn) ??
    curves.find(({ run }) => run === undefined);
  const ordered = curves.toSorted((first, second) => second.top - first.top);
  const rank = ordered.indexOf(previous) + ({ ArrowUp: 1, ArrowDown: -1 }[key] ?? 0);
  return { index, curve: ordered[Math.min(Math.max(rank, 0), ordered.length - 1)] };
}

/** Return the text of a keyboard target for screen readers. */
export function describeTarget({ index, curve }, chart, options) {
  const { names, xLabel = "", runLabel = RUN_LABEL } = options;
  const position = `${xLabel} ${names?.[index] ?? chart.data[0][index]}`;
  if (!curve) return position;
  const run = curve.run === undefined ? "" : `, ${runLabel} ${curve.run}`;
  return `${curve.label}${run}, ${position}: ${formatShort(curve.value)}`;
}

export function formatShort(value) {
  if (value === 0) return "0";
  const size = Math.abs(value);
  if (size >= 100) return formatDecimals(value, 0);
  return formatDecimals(value, size >= 1 ? 1 : 3);
}
