// Charts with curves and bands (uPlot). See box_chart.js for box plots.

import uPlot from "./vendor/uPlot.esm.js";
import { curvesSvg, axisRange } from "./chart_svg.js";
import { el } from "./common.js";
import { svg } from "./drawing.js";
import { palette } from "./palette.js";

export { boxChart } from "./box_chart.js";

const DASHES = [undefined, [8, 4], [8, 3, 2, 3], [2, 3]];
// With more curves, bands are paler, and a button hides all curves.
const MANY = 8;
const WHOLE = [1, 2, 5]
  .flatMap((step) => [step, 10 * step, 100 * step, 1000 * step])
  // Possible distances between generation ticks.
  .sort((line, other) => line - other);
// Visible on light and dark backgrounds.
const GRID = "rgba(128, 128, 128, 0.22)";

/**
 * Return the color and dash of a condition, as in the figures of the report. The first 28 differ.
 */
export function seriesStyle(number) {
  return {
    color: palette[`series-${number % 7}`],
    dash: DASHES[((number % 7) + Math.floor(number / 7)) % 4],
  };
}

/**
 * @typedef {object} Series
 * @property {string} label
 * @property {ArrayLike<number|null>} values one per position on the x axis
 * @property {ArrayLike<number>} [low] lower edge of the band
 * @property {ArrayLike<number>} [high] upper edge of the band
 * @property {string} [color] "#rrggbb", by default that of `seriesStyle`
 * @property {number[]} [dash] lengths of dashes and gaps, in pixels
 * @property {{run: number, values: ArrayLike<number|null>}[]} [runs] the runs of a mean, drawn as
 *   thin lines
 *
 * @typedef {object} LineChart
 * @property {(x: ArrayLike<number>, series: Series[]) => void} update shows other data; hidden
 *   labels stay hidden
 * @property {(index: number|null) => void} mark moves the cursor to a position of the x axis, or
 *   removes it
 * @property {() => string} svg returns the visible chart as the text of a file
 * @property {() => void} destroy
 */

/**
 * Return a checkbox that shows each run as a thin line.
 * @param {(isChecked: boolean) => void} changed
 */
export function runSwitch(checked, changed) {
  const input = el("input", {
    type: "checkbox",
    checked,
    "data-testid": "each-run",
    onchange: () => changed(input.checked),
  });
  return el("label", { class: "inline" }, input, "show each run");
}

/**
 * Draw curves over a shared x axis, with a legend that hides and shows them.
 * @param {HTMLElement} root is emptied and filled; the chart follows its width
 * @param {object} options
 * @param {string} options.title above the chart, and for screen readers
 * @param {ArrayLike<number>} options.x in ascending order
 * @param {string[]} [options.names] of the positions on the x axis, which are then 0, 1, 2, ...
 * @param {Series[]} options.series
 * @param {string} [options.xLabel]
 * @param {string} [options.yLabel]
 * @param {number} [options.height] of the plot, in CSS pixels
 * @param {string[]} [options.hidden] labels of series that are hidden at first
 * @param {(hidden: string[]) => void} [options.onHidden] called when the user hides or shows a
 *   series
 * @param {(pick: {index: number, x: number, label: string, run?: number}) => void} [options.onPick]
 *   called for a click, a tap or Enter on a curve
 * @returns {LineChart}
 */
export function lineChart(root, options) {
  const legend = el("div", { class: "chart-legend" });
  const plot = el("div", {
    class: "chart-plot",
    tabindex: "0",
    role: "group",
    "aria-label": options.title,
  });
  // The run under the pointer.
  const pointedRun = el("span", { class: "chart-run soft" });
  // Announces the keyboard target to screen readers.
  const announcement = el("span", { class: "visually-hidden", role: "status" });
  root.replaceChildren(
    el("div", { class: "chart-title" }, options.title),
    plot,
    legend,
    announcement,
  );
  const hidden = new Set(options.hidden ?? []);
  let { x, series } = options;
  let chart = null;

  const build = () => {
    chart?.destroy();
    const size = { width: Math.max(root.clientWidth, 160), height: options.height ?? 260 };
    chart = new uPlot(
      { ...size, ...settings(plot, series, hidden, options, showValues) },
      columns(x, series),
      plot,
    );
    bindPick(chart, () => series, options.onPick);
    showLegend();
  };
  const showLegend = () => {
    const all = el(
      "button",
      { type: "button", class: "chart-all", onclick: toggleAll },
      hidden.size ? "Show all" : "Hide all",
    );
    legend.replaceChildren(
      ...series.map((line, number) => legendEntry(line, number, hidden, toggle)),
      ...(series.length > MANY ? [all] : []),
      pointedRun,
    );
  };
  const toggle = (label) => {
    if (!hidden.delete(label)) hidden.add(label);
    changeShown(series.findIndex((line) => line.label === label));
  };
  const toggleAll = () => {
    if (hidden.size) hidden.clear();
    else series.forEach((line) => hidden.add(line.label));
    changeShown(series.length);
  };
  const changeShown = (pressed) => {
    chart.batch(() =>
      curvesOf(series).forEach(({ columns, label }) => {
        for (const column of columns) chart.setSeries(column, { show: !hidden.has(label) });
      }),
    );
    showLegend();
    legend.querySelectorAll("button")[pressed].focus();
    options.onHidden?.([...hidden]);
  };
  const showValues = (index, focused) => {
    legend.querySelectorAll(".chart-value").forEach((element, number) => {
      const value = index == null ? null : series[number]?.values[index];
      element.textContent = value == null ? "" : formatShort(value);
    });
    const { run, label, values } =
      curvesOf(series).find(({ columns: [column] }) => column === focused) ?? {};
    pointedRun.textContent =
      run === undefined || values[index] == null
        ? ""
        : `${label}, run ${run}: ${formatShort(values[index])}`;
  };

  build();
  const resized = new ResizeObserver(() =>
    chart.setSize({ width: Math.max(root.clientWidth, 160), height: chart.height }),
  );
  resized.observe(root);
  const scheme = matchMedia("(prefers-color-scheme: dark)");
  const recolor = () => chart.redraw();
  scheme.addEventListener("change", recolor);
  // The column of the keyboard target.
  let chosen = null;
  plot.addEventListener("keydown", (event) => {
    const target = readKey(event, chart, series, chosen);
    if (!target) return;
    event.preventDefault();
    event.stopPropagation();
    if (event.key === "Enter")
      return void (target.curve && options.onPick?.(pickOf(chart, target.index, target.curve)));
    setCursor(chart, target.index, target.curve?.top);
    chosen = target.curve?.columns[0] ?? null;
    // Selects one of several curves at the same position.
    chart.setSeries(chosen, { focus: true });
    announcement.textContent = describeTarget(target, chart, options);
  });

  return {
    update(newX, newSeries) {
      const same =
        newSeries.length === series.length &&
        newSeries.every(
          (line, number) =>
            line.label === series[number].label &&
            line.runs?.length === series[number].runs?.length,
        );
      [x, series] = [newX, newSeries];
      if (same) chart.setData(columns(x, series));
      else build();
    },
    mark(index) {
      setCursor(chart, index);
    },
    svg() {
      const shown = series
        .map((line, number) => ({ ...seriesStyle(number), ...line }))
        .filter(({ label }) => !hidden.has(label));
      return curvesSvg({ ...options, x, series: shown });
    },
    destroy() {
      resized.disconnect();
      scheme.removeEventListener("change", recolor);
      chart.destroy();
    },
  };
}

/**
 * Return the columns of uPlot.
 *
 * The lines of runs come first, so they are drawn below. Each series has three columns: its mean,
 * and the edges of its band, which are empty without a band.
 */
function columns(x, series) {
  const empty = new Array(x.length).fill(null);
  return [
    x,
    ...runsOf(series).map(({ values }) => values),
    ...series.flatMap((line) => [line.values, line.high ?? empty, line.low ?? empty]),
  ];
}

function runsOf(series) {
  return series.flatMap(({ label, runs = [] }, number) =>
    runs.map(({ run, values }) => ({ label, number, run, values })),
  );
}

/**
 * Return the lines of runs and the means with their columns. The first column is the line itself.
 */
function curvesOf(series) {
  const runs = runsOf(series).map((line, element) => ({ ...line, columns: [element + 1] }));
  return [
    ...runs,
    ...series.map(({ label, values }, number) => {
      const column = runs.length + 3 * number + 1;
      return { label, number, values, columns: [column, column + 1, column + 2] };
    }),
  ];
}

function settings(plot, series, hidden, options, showValues) {
  const ink = () => getComputedStyle(plot).color;
  const font = "12px system-ui, sans-serif";
  const axis = (label) => ({
    label,
    font,
    labelFont: font,
    stroke: ink,
    grid: { stroke: GRID, width: 1 },
    ticks: { stroke: GRID, width: 1 },
    labelSize: 18,
  });
  const edge = (show) => ({ show, stroke: "transparent", width: 0, points: { show: false } });
  const runs = runsOf(series).map(({ label, number }) => {
    const color = series[number].color ?? seriesStyle(number).color;
    return {
      label,
      show: !hidden.has(label),
      stroke: `${color}73`,
      width: 1,
      points: { show: false },
    };
  });
  const lines = series.flatMap((line, number) => {
    const { color, dash } = { ...seriesStyle(number), ...line };
    const show = !hidden.has(line.label);
    const points = { show: Boolean(options.names) || line.values.length < 2, size: 6, fill: color };
    return [
      { label: line.label, show, stroke: color, dash, width: 2, points },
      edge(show),
      edge(show),
    ];
  });
  const means = new Set(
    curvesOf(series)
      .filter(({ run }) => run === undefined)
      .map(({ columns: [column] }) => column),
  );
  const isCurve = (column) => column <= runs.length || means.has(column);
  let focused = null;
  return {
    legend: { show: false },
    scales: {
      x: { time: false, ...(options.names && { range: [-0.5, options.names.length - 0.5] }) },
      y: { range: (_, low, high) => axisRange(low, high) },
    },
    axes: [
      { ...axis(options.xLabel), space: 60, size: 30, incrs: WHOLE, ...namedTicks(options.names) },
      { ...axis(options.yLabel), size: 56 },
    ],
    series: [{}, ...runs, ...lines],
    bands: series.map((line, number) => ({
      series: [runs.length + 3 * number + 2, runs.length + 3 * number + 3],
      fill: `${line.color ?? seriesStyle(number).color}${series.length > MANY ? "12" : "2e"}`,
    })),
    focus: { alpha: 0.25 },
    cursor: {
      focus: {
        prox: 24,
        dist: (_, column, index, value, cursor) => (isCurve(column) ? value - cursor : Infinity),
        // Ignore the edges of bands.
      },
      // uPlot would treat a click near an edge as a drag, because its cursor snaps to the edge.
      drag: { x: false, y: false, click() {} },
      y: false,
      points: { show: (chart, column) => means.has(column) && cursorPoint(chart, column) },
    },
    hooks: {
      setCursor: [(chart) => showValues(chart.cursor.idx, focused)],
      setSeries: [
        (chart, column, { focus }) =>
          focus === undefined || showValues(chart.cursor.idx, (focused = column)),
      ],
    },
  };
}

/** Return the ticks of an axis with named positions. */
function namedTicks(names) {
  return (
    names && {
      splits: () => names.map((_, element) => element),
      values: (_, places) => places.map((element) => names[element]),
    }
  );
}

function cursorPoint(chart, column) {
  return el("div", { class: "u-cursor-pt", style: `background:${chart.series[column].stroke()}` });
}

function legendEntry(line, number, hidden, toggle) {
  const { color, dash } = { ...seriesStyle(number), ...line };
  const button = el(
    "button",
    { type: "button", class: "chart-key", "aria-pressed": String(!hidden.has(line.label)) },
    swatch(color, dash),
    el("span", {}, line.label),
    el("span", { class: "chart-value" }),
  );
  button.addEventListener("click", () => toggle(line.label));
  return button;
}

function swatch(color, dash = []) {
  const line = {
    d: "M0 2H22",
    stroke: color,
    "stroke-width": 3,
    "stroke-dasharray": dash.map((length) => length * 0.8).join(" "),
  };
  return svg("svg", { width: 22, height: 4, "aria-hidden": "true" }, svg("path", line));
}

function bindPick(chart, currentSeries, onPick) {
  if (!onPick) return;
  chart.over.style.cursor = "pointer";
  chart.over.addEventListener("click", (event) => {
    const element = chart.over.getBoundingClientRect();
    const index = chart.posToIdx(event.clientX - element.left);
    const [nearest] = visibleCurvesAt(chart, currentSeries(), index).sort(
      (line, other) => distance(line, event, element) - distance(other, event, element),
    );
    if (nearest) onPick(pickOf(chart, index, nearest));
  });
}

function distance({ top }, event, element) {
  return Math.abs(top - (event.clientY - element.top));
}

/** Return the visible curves with a value at an index of the x axis, and their heights. */
function visibleCurvesAt(chart, series, index) {
  return curvesOf(series)
    .map((curve) => ({ ...curve, value: curve.values[index] }))
    .filter(({ columns: [column], value }) => chart.series[column].show && value != null)
    .map((curve) => ({ ...curve, top: chart.valToPos(curve.value, "y") }));
}

function pickOf(chart, index, { label, run }) {
  return { index, x: chart.data[0][index], label, ...(run !== undefined && { run }) };
}

function setCursor(chart, index, top = 0) {
  const left = index == null ? -10 : chart.valToPos(chart.data[0][index], "x");
  chart.setCursor({ left, top: index == null ? -10 : top });
}

/**
 * Return the target of a key, or null: left and right move along the x axis, up and down between
 * curves.
 */
function readKey({ key }, chart, series, chosen) {
  const last = chart.data[0].length - 1;
  const now = chart.cursor.idx ?? last;
  const target = {
    ArrowLeft: now - 1,
    ArrowRight: now + 1,
    PageUp: now - 10,
    PageDown: now + 10,
    Home: 0,
    End: last,
    ArrowUp: now,
    ArrowDown: now,
    Enter: now,
  }[key];
  if (target === undefined) return null;
  const index = Math.min(Math.max(target, 0), last);
  const curves = visibleCurvesAt(chart, series, index);
  const previous =
    curves.find(({ columns: [column] }) => column === chosen) ??
    curves.find(({ run }) => run === undefined);
  const ordered = curves.toSorted((line, other) => other.top - line.top);
  const rank = ordered.indexOf(previous) + ({ ArrowUp: 1, ArrowDown: -1 }[key] ?? 0);
  return { index, curve: ordered[Math.min(Math.max(rank, 0), ordered.length - 1)] };
}

/** Return the text of a keyboard target for screen readers. */
function describeTarget({ index, curve }, chart, { names, xLabel = "" }) {
  const position = `${xLabel} ${names?.[index] ?? chart.data[0][index]}`;
  if (!curve) return position;
  const run = curve.run === undefined ? "" : `, run ${curve.run}`;
  return `${curve.label}${run}, ${position}: ${formatShort(curve.value)}`;
}

function formatShort(value) {
  if (value === 0) return "0";
  return Math.abs(value) >= 100 ? value.toFixed(0) : value.toFixed(Math.abs(value) >= 1 ? 1 : 3);
}
