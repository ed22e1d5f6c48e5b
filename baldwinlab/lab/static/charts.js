/** Charts with curves and bands (uPlot). See box_chart.js for box plots. */

import uPlot from "./vendor/uPlot.esm.js";
import {
  bindPick,
  describePick,
  describeTarget,
  formatShort,
  readKey,
  setCursor,
} from "./chart_cursor.js";
import { createLegendEntry } from "./chart_legend.js";
import { createSettings } from "./chart_options.js";
import {
  MAX_PLAIN_CURVES,
  collectColumns,
  collectCurves,
  selectSeriesStyle,
} from "./chart_series.js";
import { drawCurvesFile } from "./chart_svg.js";
import { el } from "./common.js";

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
export function createLineChart(root, options) {
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
      { ...size, ...createSettings(plot, series, hidden, options, showValues) },
      collectColumns(x, series),
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
      ...series.map((line, number) => createLegendEntry(line, number, hidden, toggle)),
      ...(series.length > MAX_PLAIN_CURVES ? [all] : []),
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
      collectCurves(series).forEach(({ columns, label }) => {
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
      collectCurves(series).find(({ columns: [column] }) => column === focused) ?? {};
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
    if (event.key === "Enter") {
      if (target.curve) options.onPick?.(describePick(chart, target.index, target.curve));
      return;
    }
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
      x = newX;
      series = newSeries;
      if (same) chart.setData(collectColumns(x, series));
      else build();
    },
    mark(index) {
      setCursor(chart, index);
    },
    svg() {
      const shown = series
        .map((line, number) => ({ ...selectSeriesStyle(number), ...line }))
        .filter(({ label }) => !hidden.has(label));
      return drawCurvesFile({ ...options, x, series: shown });
    },
    destroy() {
      resized.disconnect();
      scheme.removeEventListener("change", recolor);
      chart.destroy();
    },
  };
}
