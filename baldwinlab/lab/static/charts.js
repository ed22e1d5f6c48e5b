// Charts: curves with bands (uPlot), and box plots whose points are links (box_chart.js). Both follow the page's colours.

import uPlot from "./vendor/uPlot.esm.js";
import { svg } from "./box_chart.js";
import { el } from "./common.js";
import { palette } from "./palette.js";

export { boxChart } from "./box_chart.js";

const DASHES = [undefined, [8, 4], [8, 3, 2, 3], [2, 3]];
const MANY = 8; // curves beyond which bands fade, and all can be hidden at once
const GRID = "rgba(128, 128, 128, 0.22)"; // shows on light and on dark

/** How the `number`-th condition is drawn, as in the report's figures; the first 28 differ. */
export function look(number) {
  return { color: palette[`series-${number % 7}`], dash: DASHES[((number % 7) + Math.floor(number / 7)) % 4] };
}

/**
 * @typedef {object} Series
 * @property {string} label
 * @property {ArrayLike<number|null>} values one a place on the x axis
 * @property {ArrayLike<number>} [low] lower edge of its band
 * @property {ArrayLike<number>} [high] upper edge of its band
 * @property {string} [color] "#rrggbb"; that of `look` where it is not given
 * @property {number[]} [dash] pixels drawn and left out
 *
 * @typedef {object} LineChart
 * @property {(x: ArrayLike<number>, series: Series[]) => void} update shows other data; what is hidden stays hidden by its label
 * @property {(index: number|null) => void} mark puts the cursor on a place of the x axis, or takes it away
 * @property {() => void} destroy frees what it used
 */

/**
 * Curves over a shared x axis, with a legend whose entries hide and show them.
 * @param {HTMLElement} root is emptied and filled; its width is followed
 * @param {object} options
 * @param {string} options.title what is shown, for screen readers and above the chart
 * @param {ArrayLike<number>} options.x rising
 * @param {Series[]} options.series
 * @param {string} [options.xLabel]
 * @param {string} [options.yLabel]
 * @param {number} [options.height] CSS pixels of the plot
 * @param {string[]} [options.hidden] labels of series not shown at first
 * @param {(hidden: string[]) => void} [options.onHidden] told when the reader hides or shows one
 * @param {(pick: {index: number, x: number, label: string}) => void} [options.onPick] a click, a tap or Enter on a curve
 * @returns {LineChart}
 */
export function lineChart(root, options) {
  const legend = el("div", { class: "chart-legend" });
  const plot = el("div", { class: "chart-plot", tabindex: "0", role: "group", "aria-label": options.title });
  root.replaceChildren(el("div", { class: "chart-title" }, options.title), plot, legend);
  const hidden = new Set(options.hidden ?? []);
  let { x, series } = options;
  let chart = null;

  const build = () => {
    chart?.destroy();
    const size = { width: Math.max(root.clientWidth, 160), height: options.height ?? 260 };
    chart = new uPlot({ ...size, ...settings(plot, series, hidden, options, showValues) }, columns(x, series), plot);
    bindPick(chart, () => series, options.onPick);
    showLegend();
  };
  const showLegend = () => {
    const all = el("button", { type: "button", class: "chart-all", onclick: toggleAll }, hidden.size ? "Show all" : "Hide all");
    legend.replaceChildren(...series.map((one, number) => legendEntry(one, number, hidden, toggle)), ...(series.length > MANY ? [all] : []));
  };
  const toggle = (label) => {
    if (!hidden.delete(label)) hidden.add(label);
    changeShown(series.findIndex((one) => one.label === label));
  };
  const toggleAll = () => {
    if (hidden.size) hidden.clear();
    else series.forEach((one) => hidden.add(one.label));
    changeShown(series.length);
  };
  const changeShown = (pressed) => {
    chart.batch(() => series.forEach((one, number) => {
      for (let edge = 1; edge <= 3; edge++) chart.setSeries(3 * number + edge, { show: !hidden.has(one.label) });
    }));
    showLegend();
    legend.querySelectorAll("button")[pressed].focus();
    options.onHidden?.([...hidden]);
  };
  const showValues = (index) => {
    legend.querySelectorAll(".chart-value").forEach((place, number) => {
      const value = index == null ? null : series[number]?.values[index];
      place.textContent = value == null ? "" : brief(value);
    });
  };

  build();
  const resized = new ResizeObserver(() => chart.setSize({ width: Math.max(root.clientWidth, 160), height: chart.height }));
  resized.observe(root);
  const scheme = matchMedia("(prefers-color-scheme: dark)");
  const recolor = () => chart.redraw();
  scheme.addEventListener("change", recolor);
  plot.addEventListener("keydown", (event) => moveCursor(event, chart, series, hidden, options.onPick));

  return {
    update(newX, newSeries) {
      const same = newSeries.length === series.length && newSeries.every((one, number) => one.label === series[number].label);
      [x, series] = [newX, newSeries];
      if (same) chart.setData(columns(x, series));
      else build();
    },
    mark(index) {
      setCursor(chart, index);
    },
    destroy() {
      resized.disconnect();
      scheme.removeEventListener("change", recolor);
      chart.destroy();
    },
  };
}

/** Three columns a series: its values, and the edges of its band (empty where it has none). */
function columns(x, series) {
  const empty = new Array(x.length).fill(null);
  return [x, ...series.flatMap((one) => [one.values, one.high ?? empty, one.low ?? empty])];
}

function settings(plot, series, hidden, options, showValues) {
  const ink = () => getComputedStyle(plot).color;
  const font = "12px system-ui, sans-serif";
  const axis = (label) => ({ label, font, labelFont: font, stroke: ink, grid: { stroke: GRID, width: 1 }, ticks: { stroke: GRID, width: 1 }, labelSize: 18 });
  const edge = (show) => ({ show, stroke: "transparent", width: 0, points: { show: false } });
  const lines = series.flatMap((one, number) => {
    const { color, dash } = { ...look(number), ...one };
    const show = !hidden.has(one.label);
    const alone = { show: one.values.length < 2, size: 6, fill: color };
    return [{ label: one.label, show, stroke: color, dash, width: 2, points: alone }, edge(show), edge(show)];
  });
  return {
    legend: { show: false },
    scales: { x: { time: false }, y: { range: (_, low, high) => rangeFrom(low, high) } },
    axes: [{ ...axis(options.xLabel), space: 60, size: 30 }, { ...axis(options.yLabel), size: 56 }],
    series: [{}, ...lines],
    bands: series.map((one, number) => ({
      series: [3 * number + 2, 3 * number + 3],
      fill: `${one.color ?? look(number).color}${series.length > MANY ? "12" : "2e"}`,
    })),
    focus: { alpha: 0.25 },
    cursor: {
      focus: { prox: 24, dist: (_, column, index, value, cursor) => (column % 3 === 1 ? value - cursor : Infinity) }, // lines, not edges
      drag: { x: false, y: false, click() {} }, // uPlot would take a click near an edge, where its cursor snaps, for a drag
      y: false,
      points: { show: (chart, column) => column % 3 === 1 && cursorPoint(chart, column) },
    },
    hooks: { setCursor: [(chart) => showValues(chart.cursor.idx)] },
  };
}

function rangeFrom(low, high) {
  if (low == null) return [0, 1];
  return [Math.min(low, 0), high > Math.max(low, 0) ? high * 1.05 : Math.max(low, 0) + 1]; // items eaten and shares begin at nought
}

function cursorPoint(chart, column) {
  return el("div", { class: "u-cursor-pt", style: `background:${chart.series[column].stroke()}` });
}

function legendEntry(one, number, hidden, toggle) {
  const { color, dash } = { ...look(number), ...one };
  const button = el("button", { type: "button", class: "chart-key", "aria-pressed": String(!hidden.has(one.label)) },
    swatch(color, dash), el("span", {}, one.label), el("span", { class: "chart-value" }));
  button.addEventListener("click", () => toggle(one.label));
  return button;
}

function swatch(color, dash = []) {
  const line = { d: "M0 2H22", stroke: color, "stroke-width": 3, "stroke-dasharray": dash.map((length) => length * 0.8).join(" ") };
  return svg("svg", { width: 22, height: 4, "aria-hidden": "true" }, svg("path", line));
}

function bindPick(chart, currentSeries, onPick) {
  if (!onPick) return;
  chart.over.style.cursor = "pointer";
  chart.over.addEventListener("click", (event) => {
    const place = chart.over.getBoundingClientRect();
    pickAt(chart, currentSeries(), chart.posToIdx(event.clientX - place.left), event.clientY - place.top, onPick);
  });
}

/** Picks the shown curve nearest to a height at an index of the x axis. */
function pickAt(chart, series, index, top, onPick) {
  let nearest = null;
  series.forEach((one, number) => {
    const value = one.values[index];
    if (!chart.series[3 * number + 1].show || value == null) return;
    const distance = Math.abs(chart.valToPos(value, "y") - top);
    if (!nearest || distance < nearest.distance) nearest = { distance, label: one.label };
  });
  if (nearest) onPick({ index, x: chart.data[0][index], label: nearest.label });
}

function setCursor(chart, index) {
  const left = index == null ? -10 : chart.valToPos(chart.data[0][index], "x");
  chart.setCursor({ left, top: index == null ? -10 : 0 });
}

function moveCursor(event, chart, series, hidden, onPick) {
  const last = chart.data[0].length - 1;
  const now = chart.cursor.idx ?? last;
  const to = { ArrowLeft: now - 1, ArrowRight: now + 1, PageUp: now - 10, PageDown: now + 10, Home: 0, End: last }[event.key];
  if (to !== undefined) setCursor(chart, Math.min(Math.max(to, 0), last));
  else if (event.key === "Enter" && onPick) {
    const first = series.find((one) => !hidden.has(one.label));
    if (first) onPick({ index: now, x: chart.data[0][now], label: first.label });
  } else return;
  event.preventDefault();
  event.stopPropagation();
}

function brief(value) {
  if (value === 0) return "0";
  return Math.abs(value) >= 100 ? value.toFixed(0) : value.toFixed(Math.abs(value) >= 1 ? 1 : 3);
}
