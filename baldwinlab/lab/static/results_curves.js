/** The curves of a study, generation by generation. */

import { selectSeriesStyle } from "./chart_series.js";
import { LineChart } from "./charts.js";
import { el, showMessage } from "./common.js";
import { createChartDownloads, createDownloadButton, formatCsv } from "./downloads.js";
import { combineCurves } from "./results_factors.js";
import { hasWorldView } from "./results_measures.js";
import { formatLifetimeAddress } from "./sources.js";

const MEAN_COLUMNS = ["curve", "generation", "mean", "low", "high"];
const RUN_COLUMNS = ["curve", "run", "generation", "value"];

export function explainCurves(view) {
  if (!view.hasSingleConditions)
    return (
      `Each curve is the mean of the conditions with one value of ${view.by}. Its ` +
      "band goes from the lowest to the highest condition. Click a curve to see its " +
      "conditions."
    );
  const bands = "Bands: 95 % confidence intervals over runs.";
  if (!hasWorldView(view)) return bands;
  return view.hasRunLines
    ? `Click a line to watch its run. ${bands}`
    : `Click a curve to watch its typical run. ${bands}`;
}

/** Return one row per generation of each curve. */
function listMeanRows(generations, series) {
  return series.flatMap(({ label, values, low, high }) =>
    generations.map((generation, index) => ({
      curve: label,
      generation,
      mean: values[index],
      low: low[index],
      high: high[index],
    })),
  );
}

function listRunRows(generations, series) {
  return series.flatMap(({ label, runs = [] }) =>
    runs.flatMap(({ run, values }) =>
      generations
        .map((generation, index) => ({ curve: label, run, generation, value: values[index] }))
        .filter(({ value }) => value !== null),
    ),
  );
}

/** The chart of the curves, with downloads. */
export class ResultsCurves {
  /**
   * @param {HTMLElement} root is filled
   * @param {import("./view_results.js").ResultsState} view
   * @param {(labels: string) => void} setHidden called with the hidden labels, joined by commas
   */
  constructor(root, view, setHidden) {
    this.view = view;
    this.setHidden = setHidden;
    this.isDestroyed = false;
    this.series = createMeanSeries(view);
    const plot = el("div");
    this.chart = this.createChart(plot);
    this.downloads = createChartDownloads(
      "curves",
      MEAN_COLUMNS,
      () => listMeanRows(view.results.generation, this.series),
      () => this.chart.drawFile(),
    );
    root.append(plot, this.downloads);
    if (view.hasRunLines) this.addRuns();
  }

  createChart(plot) {
    const { results, measure, hidden } = this.view;
    const { title, axis } = results.measures[measure];
    return new LineChart(plot, {
      title,
      x: results.generation,
      xLabel: "generation",
      yLabel: axis,
      height: 320,
      series: this.series,
      hidden: hidden ? hidden.split(",") : [],
      onHidden: (labels) => this.rememberHidden(labels.join(",")),
      onPick: (pick) => this.openPick(pick),
    });
  }

  rememberHidden(labels) {
    this.setHidden(labels);
    this.view.navigate({ hidden: labels || null });
  }

  /** Open the lifetime of a picked curve, or the conditions of a curve that combines several. */
  openPick(/** @type {{x: number, label: string, run?: number}} */ { x, label, run }) {
    const { study, results, by, groups, choose } = this.view;
    const { conditions } = groups.find((group) => group.label === label);
    if (conditions.length > 1) return choose({ [`only.${by}`]: label, group: null, hidden: null });
    const [condition] = conditions;
    if (!hasWorldView({ study }, condition)) return showMessage("This model has no world to show.");
    location.hash = formatLifetimeAddress({
      study: study.id,
      condition,
      run: run ?? results.typical_run[condition],
      generation: x,
    });
  }

  /** Add the lines of runs to the chart, and a download of their values. */
  async addRuns() {
    const status = el("span", { class: "soft" }, "Reading the runs …");
    this.downloads.append(status);
    try {
      const curvesByRun = await this.loadRuns();
      if (this.isDestroyed) return;
      this.showRuns(curvesByRun);
      const listRows = () => listRunRows(this.view.results.generation, this.series);
      status.replaceWith(
        createDownloadButton("run-curves.csv", () => formatCsv(RUN_COLUMNS, listRows())),
      );
    } catch (error) {
      if (!this.isDestroyed) status.textContent = error.message;
    }
  }

  /** Return the curves of each condition, by run. */
  loadRuns() {
    const { study, measure, groups, load } = this.view;
    return Promise.all(
      groups.map(({ conditions: [condition] }) =>
        load(`/api/results/runs?${new URLSearchParams({ study: study.id, condition, measure })}`),
      ),
    );
  }

  showRuns(curvesByRun) {
    const { generation: generations } = this.view.results;
    this.series = this.series.map((line, number) => ({
      ...line,
      runs: Object.entries(curvesByRun[number]).map(([run, values]) => ({
        run: Number(run),
        values: generations.map((_, index) => values[index] ?? null),
      })),
    }));
    this.chart.update(generations, this.series);
  }

  destroy() {
    this.isDestroyed = true;
    this.chart.destroy();
  }
}

/** Return one series per group of conditions. */
function createMeanSeries({ results, measure, groups }) {
  return groups.map(({ label, conditions }, number) => {
    const { mean, low, high } = combineCurves(
      conditions.map((name) => results.curves[name][measure]),
    );
    return { label, values: mean, low, high, ...selectSeriesStyle(number) };
  });
}
