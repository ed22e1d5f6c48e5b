/** The curves of a live run. */

import { selectSeriesStyle } from "./chart_series.js";
import { LineChart } from "./charts.js";
import { el } from "./common.js";
import { createChartDownloads } from "./downloads.js";

const CSV_COLUMNS = ["curve", "generation", "mean", "low", "high"];

/** Fitness and the share of agents that eat. A click on a curve shows that generation. */
export class LiveCurves {
  /**
   * @param {import("./live_feed.js").Feed} feed
   * @param {HTMLElement} fitnessRoot is filled
   * @param {HTMLElement} shareRoot is filled
   * @param {HTMLInputElement} runSwitch is checked if each run is drawn
   * @param {(generation: number, run?: number) => void} pick
   */
  constructor(feed, fitnessRoot, shareRoot, runSwitch, pick) {
    Object.assign(this, { feed, runSwitch, pick });
    const { generations } = feed.summary.experiment.evolution;
    // The axis covers all generations from the start.
    this.x = Array.from({ length: generations }, (_, generation) => generation);
    this.hasWorld = Boolean(feed.summary.experiment.world);
    this.frame = 0;
    this.fitnessChart = this.createFitnessChart(fitnessRoot);
    this.shareChart = this.createShareChart(shareRoot);
  }

  createFitnessChart(root) {
    const { runs } = this.feed.summary;
    const suffix = runs > 1 ? `, mean of ${runs} runs with 95 % interval` : "";
    return this.createChart(root, "fitness", () => this.listFitnessSeries(), {
      title: `Fitness${suffix}`,
      yLabel: this.hasWorld ? "fitness (energy)" : "fitness",
      height: 210,
    });
  }

  createShareChart(root) {
    return this.createChart(root, "share", () => this.listShareSeries(), {
      title: this.hasWorld ? "Share of agents that eat" : "Share of agents with fitness above 0",
      yLabel: "share",
      height: 150,
    });
  }

  /** Create a chart with downloads. `name` is the name of the files. */
  createChart(root, name, listSeries, options) {
    const plot = el("div");
    const chart = new LineChart(plot, {
      ...options,
      x: this.x,
      xLabel: "generation",
      onPick: ({ x, run }) => this.pick(x, run),
      series: listSeries(),
    });
    const rows = () => listSeries().flatMap((line) => this.listRows(line));
    root.append(
      plot,
      createChartDownloads(name, CSV_COLUMNS, rows, () => chart.drawFile()),
    );
    return chart;
  }

  listFitnessSeries() {
    return [
      this.createSeries("best agent", "best", 0),
      this.createSeries("average agent", "mean", 1),
    ];
  }

  listShareSeries() {
    const label = this.hasWorld ? "share of agents that eat" : "share above 0";
    return [this.createSeries(label, "share", 2)];
  }

  /** Return the series of a measure. It is null in generations that are not finished. */
  createSeries(label, measure, styleNumber) {
    const { mean, low, high, runs: runValues = [] } = this.feed.bands[measure];
    const pad = (values) => values && this.x.map((generation) => values[generation] ?? null);
    const runCount = this.runSwitch.checked ? this.feed.summary.runs : 0;
    const runLines = Array.from({ length: runCount }, (_, run) => ({
      run,
      values: pad(runValues.map((values) => values[run])),
    }));
    return {
      label,
      color: selectSeriesStyle(styleNumber).color,
      values: pad(mean),
      low: pad(low),
      high: pad(high),
      runs: runLines,
    };
  }

  /** Return one row per finished generation. */
  listRows({ label, values, low, high }) {
    return this.x.slice(0, this.feed.generationsDone).map((generation) => ({
      curve: label,
      generation,
      mean: values[generation],
      low: low?.[generation],
      high: high?.[generation],
    }));
  }

  /** Draw the curves once per frame, independent of the number of messages. */
  update() {
    this.frame ||= requestAnimationFrame(() => this.draw());
  }

  draw() {
    this.frame = 0;
    this.fitnessChart.update(this.x, this.listFitnessSeries());
    this.shareChart.update(this.x, this.listShareSeries());
  }

  close() {
    cancelAnimationFrame(this.frame);
    this.fitnessChart.destroy();
    this.shareChart.destroy();
  }
}
