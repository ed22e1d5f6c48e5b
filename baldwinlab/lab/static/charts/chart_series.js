/** The series of a chart: styles, columns and options of uPlot, and legend. */

import { palette } from "../core/palette.js";
import { createButton, el, formatNumber } from "../core/common.js";
import { computeRange, createSvg } from "../core/drawing.js";

const DASHES = [undefined, [8, 4], [8, 3, 2, 3], [2, 3]];

// With more curves, bands are paler, and a button hides all curves.
export const MAX_PLAIN_CURVES = 8;

/**
 * Return the color and dash of a condition, as in the figures of the report. The first 28 differ.
 */
export function selectSeriesStyle(number) {
  return {
    color: palette[`series-${number % 7}`],
    dash: DASHES[((number % 7) + Math.floor(number / 7)) % 4],
  };
}

/**
 * Return the columns of uPlot.
 *
 * The lines of runs come first, so they are drawn below. Each series has three columns: its mean,
 * and the edges of its band, which are empty without a band.
 */
export function collectColumns(x, series) {
  const empty = new Array(x.length).fill(null);
  return [
    x,
    ...collectRuns(series).map(({ values }) => values),
    ...series.flatMap((line) => [line.values, line.high ?? empty, line.low ?? empty]),
  ];
}

function collectRuns(series) {
  return series.flatMap(({ label, runs = [] }, number) =>
    runs.map(({ run, values }) => ({ label, number, run, values }))
  );
}

/**
 * Return the lines of runs and the means with their columns. The first column is the line itself.
 */
export function collectCurves(series) {
  const runs = collectRuns(series).map((line, element) => ({ ...line, columns: [element + 1] }));
  return [
    ...runs,
    ...series.map(({ label, values }, number) => {
      const column = runs.length + 3 * number + 1;
      return { label, number, values, columns: [column, column + 1, column + 2] };
    }),
  ];
}

/**
 * Return a checkbox that shows each run as a thin line.
 * @param {(isChecked: boolean) => void} changed
 */
export function createRunSwitch(checked, changed) {
  const input = el("input", {
    type: "checkbox",
    checked,
    "data-testid": "each-run",
    onchange: () => changed(input.checked),
  });
  return el("label", { class: "inline" }, input, "show each run");
}

export function createLegendEntry(line, number, hidden, toggle) {
  const { color, dash } = { ...selectSeriesStyle(number), ...line };
  return createButton(
    [drawSwatch(color, dash), el("span", {}, line.label), el("span", { class: "chart-value" })],
    () => toggle(line.label),
    { class: "chart-key", "aria-pressed": String(!hidden.has(line.label)) },
  );
}

function drawSwatch(color, dash = []) {
  const line = {
    d: "M0 2H22",
    stroke: color,
    "stroke-width": 3,
    "stroke-dasharray": dash.map((length) => length * 0.8).join(" "),
  };
  return createSvg("svg", { width: 22, height: 4, "aria-hidden": "true" }, createSvg("path", line));
}

// Possible distances between generation ticks.
const TICK_DISTANCES = [1, 10, 100, 1000].flatMap((power) => [power, 2 * power, 5 * power]);

// Visible on light and dark backgrounds.
const GRID_COLOR = "rgba(128, 128, 128, 0.22)";
// Space between the curves and the ends of the y axis other than 0.
const AXIS_MARGIN = 1.05;

/** Return the range of the y axis for numbers. It includes 0. */
export function computeAxisRange(numbers) {
  const [low, high] = computeRange(numbers);
  return [low * AXIS_MARGIN, high * AXIS_MARGIN];
}

/**
 * Return the options of uPlot.
 * @param {HTMLElement} plot determines the color of the axes
 * @param {import("./charts.js").Series[]} series
 * @param {Set<string>} hidden labels of hidden series
 * @param {object} options as for `LineChart`
 * @param {(index: number|null, focused: number|null) => void} showValues called when the cursor
 *   moves
 */
export function createPlotOptions(plot, series, hidden, options, showValues) {
  const runs = createRunLines(series, hidden);
  const means = new Set(
    collectCurves(series)
      .filter(({ run }) => run === undefined)
      .map(({ columns: [column] }) => column),
  );
  const isCurve = (column) => column <= runs.length || means.has(column);
  let focused = null;
  return {
    legend: { show: false },
    scales: {
      x: { time: false, ...(options.names && { range: [-0.5, options.names.length - 0.5] }) },
      y: { range: (_, low, high) => computeAxisRange(options.limits?.() ?? [low, high]) },
    },
    axes: createAxes(plot, options),
    series: [{}, ...runs, ...createMeanLines(series, hidden, options)],
    bands: createBands(series, runs.length),
    focus: { alpha: 0.25 },
    cursor: {
      focus: {
        prox: 24,
        // Ignore the edges of bands.
        dist: (_, column, _index, value, cursor) => (isCurve(column) ? value - cursor : Infinity),
      },
      // uPlot would treat a click near an edge as a drag, because its cursor snaps to the edge.
      drag: { x: false, y: false, click() {} },
      y: false,
      points: { show: (chart, column) => means.has(column) && createCursorPoint(chart, column) },
    },
    hooks: {
      setCursor: [(chart) => showValues(chart.cursor.idx, focused)],
      setSeries: [
        (chart, column, { focus }) => {
          if (focus === undefined) return;
          focused = column;
          showValues(chart.cursor.idx, focused);
        },
      ],
    },
  };
}

function createAxes(plot, { names, xLabel, yLabel }) {
  const font = `12px ${palette.font}`;
  const axis = (label) => ({
    label,
    font,
    labelFont: font,
    stroke: () => getComputedStyle(plot).color,
    border: { show: true, stroke: () => palette.soft, width: 1 },
    grid: { stroke: GRID_COLOR, width: 1 },
    ticks: { stroke: () => palette.soft, width: 1, size: 4 },
    labelSize: 18,
    values: (_, numbers) => numbers.map(formatNumber),
  });
  return [
    { ...axis(xLabel), space: 60, size: 30, incrs: TICK_DISTANCES, ...createNamedTicks(names) },
    { ...axis(yLabel), size: 56 },
  ];
}

/** Return the thin lines of runs. */
function createRunLines(series, hidden) {
  return collectRuns(series).map(({ label, number }) => {
    const color = series[number].color ?? selectSeriesStyle(number).color;
    return {
      label,
      show: !hidden.has(label),
      stroke: `${color}73`,
      width: 1,
      points: { show: false },
    };
  });
}

/** Return the lines of means, each followed by the invisible edges of its band. */
function createMeanLines(series, hidden, { names }) {
  return series.flatMap((line, number) => {
    const { color, dash } = { ...selectSeriesStyle(number), ...line };
    const show = !hidden.has(line.label);
    const points = { show: Boolean(names) || line.values.length < 2, size: 6, fill: color };
    const edge = { show, stroke: "transparent", width: 0, points: { show: false } };
    return [
      { label: line.label, show, stroke: color, dash, width: 2, points },
      { ...edge },
      { ...edge },
    ];
  });
}

function createBands(series, runCount) {
  // Hexadecimal digits. With many curves, bands are paler.
  const opacity = series.length > MAX_PLAIN_CURVES ? "12" : "2e";
  return series.map((line, number) => ({
    series: [runCount + 3 * number + 2, runCount + 3 * number + 3],
    fill: (line.color ?? selectSeriesStyle(number).color) + opacity,
  }));
}

/** Return the ticks of an axis with named positions. */
function createNamedTicks(names) {
  return (
    names && {
      splits: () => names.map((_, index) => index),
      values: (_, indices) => indices.map((index) => names[index]),
    }
  );
}

function createCursorPoint(chart, column) {
  return el("div", { class: "u-cursor-pt", style: `background:${chart.series[column].stroke()}` });
}
