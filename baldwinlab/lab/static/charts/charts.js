/** Charts with curves and bands (uPlot), and their cursor. See svg_charts.js for box plots. */

// @ts-types="../vendor/uPlot.d.ts"
import uPlot from "../vendor/uPlot.esm.js";
import {
  collectColumns,
  collectCurves,
  createLegendEntry,
  createPlotOptions,
  MAX_PLAIN_CURVES,
  selectSeriesStyle,
} from "./chart_series.js";
import { drawPicture } from "./chart_picture.js";
import { createButton, el, formatNumber } from "../core/common.js";
import { createChartDownloads } from "../core/downloads.js";

// The word before the number of a run.
const RUN_LABEL = "run";

/** Call `onPick` for a click on a curve. */
function bindPick(chart, currentSeries, onPick) {
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

function describePick(chart, index, { label, run }) {
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
function readKey({ key }, chart, series, selectedColumn) {
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
function describeTarget({ index, curve }, chart, options) {
  const { names, xLabel = "", runLabel = RUN_LABEL } = options;
  const position = `${xLabel} ${names?.[index] ?? chart.data[0][index]}`;
  if (!curve) return position;
  const run = curve.run === undefined ? "" : `, ${runLabel} ${curve.run}`;
  return `${curve.label}${run}, ${position}: ${formatNumber(curve.value)}`;
}

/**
 * @typedef {object} Series
 * @property {string} label
 * @property {ArrayLike<number|null>} values one per position on the x axis
 * @property {ArrayLike<number>} [low] lower edge of the band
 * @property {ArrayLike<number>} [high] upper edge of the band
 * @property {string} [color] "#rrggbb", by default that of `selectSeriesStyle`
 * @property {number[]} [dash] lengths of dashes and gaps, in pixels
 * @property {{run: number, values: ArrayLike<number|null>}[]} [runs] the runs of a mean, drawn as
 *   thin lines
 */

// CSS pixels.
const DEFAULT_HEIGHT = 260;
const MIN_WIDTH = 160;

/** Curves over a shared x axis, with a legend that hides and shows them. */
export class LineChart {
  /**
   * @param {HTMLElement} root is emptied and filled; the chart follows its width
   * @param {object} options
   * @param {string} options.title above the chart
   * @param {string} [options.label] for screen readers and in a saved picture, by default the title
   * @param {ArrayLike<number>} options.x in ascending order
   * @param {string[]} [options.names] of the positions on the x axis, which are then 0, 1, 2, ...
   * @param {Series[]} options.series
   * @param {string} [options.xLabel]
   * @param {string} [options.yLabel]
   * @param {string} [options.note] in the saved picture: the runs and the meaning of the bands
   * @param {string} [options.runLabel] the word before the number of a run
   * @param {number} [options.height] of the plot, in CSS pixels
   * @param {() => number[]} [options.limits] the lowest and the highest number of the y axis, by
   *   default those of the visible curves
   * @param {string[]} [options.hidden] labels of series that are hidden at first
   * @param {(hidden: string[]) => void} [options.onHidden] called when the user hides or shows a
   *   series
   * @param {(pick: {index: number, x: number, label: string, run?: number}) => void}
   *   [options.onPick] called for a click, a tap or Enter on a curve
   */
  constructor(root, options) {
    this.root = root;
    this.options = options;
    this.x = options.x;
    this.series = options.series;
    this.hidden = new Set(options.hidden ?? []);
    this.chart = null;
    // The column of the curve that the keyboard has selected.
    this.selectedColumn = null;
    this.createElements();
    this.build();
    this.sizeObserver = new ResizeObserver(() =>
      this.chart.setSize({ width: this.width, height: this.chart.height })
    );
    this.sizeObserver.observe(root);
    this.colorScheme = matchMedia("(prefers-color-scheme: dark)");
    this.redraw = () => this.chart.redraw();
    this.colorScheme.addEventListener("change", this.redraw);
    this.plot.addEventListener("keydown", (event) => this.handleKey(event));
  }

  createElements() {
    const { title, label = title } = this.options;
    this.legend = el("div", { class: "chart-legend" });
    this.plot = el("div", {
      class: "chart-plot",
      tabindex: "0",
      role: "group",
      "aria-label": label,
    });
    // The run under the pointer.
    this.pointedRun = el("span", { class: "chart-run soft" });
    // Announces the keyboard target to screen readers.
    this.announcement = el("span", { class: "visually-hidden", role: "status" });
    this.root.replaceChildren(
      el("div", { class: "chart-title" }, title),
      this.plot,
      this.legend,
      this.announcement,
    );
  }

  get width() {
    return Math.max(this.root.clientWidth, MIN_WIDTH);
  }

  /** Create the uPlot chart of the current series. */
  build() {
    this.chart?.destroy();
    const showValues = (index, column) => this.showValues(index, column);
    this.chart = new uPlot(
      {
        width: this.width,
        height: this.options.height ?? DEFAULT_HEIGHT,
        ...createPlotOptions(this.plot, this.series, this.hidden, this.options, showValues),
      },
      collectColumns(this.x, this.series),
      this.plot,
    );
    bindPick(this.chart, () => this.series, this.options.onPick);
    this.showLegend();
  }

  showLegend() {
    const text = this.hidden.size ? "Show all" : "Hide all";
    const toggleButton = createButton(text, () => this.toggleAll(), { class: "chart-all" });
    this.legend.replaceChildren(
      ...this.series.map((line, number) =>
        createLegendEntry(line, number, this.hidden, (label) => this.toggle(label))
      ),
      ...(this.series.length > MAX_PLAIN_CURVES ? [toggleButton] : []),
      this.pointedRun,
    );
  }

  /** Hide or show a series. */
  toggle(label) {
    if (!this.hidden.delete(label)) this.hidden.add(label);
    this.applyHidden(this.series.findIndex((line) => line.label === label));
  }

  toggleAll() {
    if (this.hidden.size) this.hidden.clear();
    else this.series.forEach((line) => this.hidden.add(line.label));
    // The button that toggles all series is the last one.
    this.applyHidden(this.series.length);
  }

  /** Apply the hidden labels. The pressed button gets the focus, because the legend is replaced. */
  applyHidden(pressedButton) {
    this.chart.batch(() =>
      collectCurves(this.series).forEach(({ columns, label }) => {
        for (const column of columns)
          this.chart.setSeries(column, { show: !this.hidden.has(label) });
      })
    );
    this.showLegend();
    this.legend.querySelectorAll("button")[pressedButton].focus();
    this.options.onHidden?.([...this.hidden]);
  }

  /** Show the values at an index of the x axis, and the run of the focused column. */
  showValues(index, focusedColumn) {
    this.legend.querySelectorAll(".chart-value").forEach((element, number) => {
      const value = index == null ? null : this.series[number]?.values[index];
      element.textContent = value == null ? "" : formatNumber(value);
    });
    const { run, label, values } =
      collectCurves(this.series).find(({ columns: [column] }) => column === focusedColumn) ?? {};
    const hasRunValue = run !== undefined && values[index] != null;
    this.pointedRun.textContent = hasRunValue
      ? `${label}, ${this.options.runLabel ?? RUN_LABEL} ${run}: ${formatNumber(values[index])}`
      : "";
  }

  handleKey(event) {
    const { chart, options } = this;
    const target = readKey(event, chart, this.series, this.selectedColumn);
    if (!target) return;
    event.preventDefault();
    event.stopPropagation();
    if (event.key === "Enter") {
      if (target.curve) options.onPick?.(describePick(chart, target.index, target.curve));
      return;
    }
    setCursor(chart, target.index, target.curve?.top);
    this.selectedColumn = target.curve?.columns[0] ?? null;
    // Selects one of several curves at the same position.
    chart.setSeries(this.selectedColumn, { focus: true });
    this.announcement.textContent = describeTarget(target, chart, options);
  }

  /** Show other data. Hidden labels stay hidden. */
  update(x, series) {
    const hasSameCurves = series.length === this.series.length &&
      series.every(
        (line, number) =>
          line.label === this.series[number].label &&
          line.runs?.length === this.series[number].runs?.length,
      );
    this.x = x;
    this.series = series;
    if (hasSameCurves) this.chart.setData(collectColumns(x, series));
    else this.build();
  }

  /** Return the visible chart as a PNG file. */
  drawPicture() {
    const visibleSeries = this.series
      .map((line, number) => ({ ...selectSeriesStyle(number), ...line }))
      .filter(({ label }) => !this.hidden.has(label));
    const { title, label = title, note } = this.options;
    return drawPicture(this.chart.ctx.canvas, label, visibleSeries, note);
  }

  destroy() {
    this.sizeObserver.disconnect();
    this.colorScheme.removeEventListener("change", this.redraw);
    this.chart.destroy();
  }
}

/**
 * Add a chart to an element, with downloads of its data and its picture.
 * @param {HTMLElement} root
 * @param {ConstructorParameters<typeof LineChart>[1]} options
 * @param {{name: string, columns: string[], rows: () => Object<string, any>[], file?: string}}
 *   downloads as for `createChartDownloads`
 */
export function addChart(root, options, { name, columns, rows, file = name }) {
  const plot = el("div");
  const chart = new LineChart(plot, options);
  root.append(plot, createChartDownloads(name, columns, rows, () => chart.drawPicture(), file));
  return chart;
}
