/** The curves of a live run, and those of earlier runs of this page. */

import { selectSeriesStyle } from "../charts/chart_series.js";
import { addChart } from "../charts/charts.js";
import { getJSON } from "../core/common.js";
import { listCurveRows } from "../core/downloads.js";
import { createQuantileSeries } from "../charts/quantiles.js";
import { palette, resolveColor } from "../core/palette.js";
import { findChanges } from "../core/experiment_changes.js";

/** What a curve of several runs shows, by name, with the description in the title. */
export const STATISTICS = {
  mean: { name: "mean and 95 % interval", title: "mean of RUNS runs with 95 % interval" },
  median: { name: "median, 50 % and 90 %", title: "median, 50 % and 90 % of RUNS runs" },
};

const EARLIER_DASHES = [[2, 3], [8, 4], undefined];

/**
 * Fitness and the share of agents that eat, of the population or of each species. A click on a
 * curve shows that generation.
 */
export class LiveCurves {
  /**
   * @param {import("./live_feed.js").Feed} feed
   * @param {HTMLElement} fitnessRoot is filled
   * @param {HTMLElement} shareRoot is filled
   * @param {HTMLElement} countRoot is filled with the numbers of agents of each species
   * @param {HTMLInputElement} runSwitch is checked if each run is drawn
   * @param {"mean"|"median"} statistic of several runs
   * @param {(generation: number, run?: number) => void} pick
   * @param {{name: string, values: number[]}[]} earlierRuns
   */
  constructor(feed, fitnessRoot, shareRoot, countRoot, runSwitch, statistic, pick, earlierRuns) {
    this.feed = feed;
    this.runSwitch = runSwitch;
    this.statistic = statistic;
    this.pick = pick;
    this.earlierRuns = earlierRuns;
    const { generations } = feed.summary.experiment.evolution;
    // The axis covers all generations from the start.
    this.x = Array.from({ length: generations }, (_, generation) => generation);
    this.frame = 0;
    this.species = feed.summary.species ?? [];
    /** @type {{chart: import("../charts/charts.js").LineChart, listSeries: () => import("../charts/charts.js").Series[]}[]} */
    this.charts = [];
    this.createFitnessChart(fitnessRoot);
    this.createShareChart(shareRoot);
    for (const [measure, { title, axis }] of Object.entries(feed.summary.species_curves ?? {}))
      if (axis === "agents") this.createCountChart(countRoot, measure, title);
  }

  createFitnessChart(root) {
    const suffix = this.feed.summary.runs > 1 ? `, ${this.describeBands()}` : "";
    const { axis, heading, title } = this.feed.summary.measures.mean;
    this.createChart(root, "fitness", () => this.listFitnessSeries(), {
      title: `${this.species.length ? title : heading}${suffix}`,
      yLabel: axis,
      height: 210,
    });
  }

  createShareChart(root) {
    const { measures, species_curves: speciesCurves } = this.feed.summary;
    this.createChart(root, "share", () => this.listShareSeries(), {
      title: (speciesCurves?.share ?? measures.share).title,
      yLabel: "share",
      height: 150,
    });
  }

  createCountChart(root, measure, title) {
    this.createChart(root, measure, () => this.listSpeciesSeries(measure), {
      title,
      yLabel: "agents",
      height: 150,
    });
  }

  /** Return what the lines and bands of the runs are. */
  describeBands() {
    return STATISTICS[this.statistic].title.replace("RUNS", String(this.feed.summary.runs));
  }

  /** Create a chart with downloads. The files are named by the experiment, `name` and the runs. */
  createChart(root, name, listSeries, options) {
    const { experiment, runs } = this.feed.summary;
    const file = `${experiment.name}-${name}-${runs}-runs`.replaceAll("/", "-");
    const rows = () => {
      const finished = this.x.slice(0, this.feed.generationsDone);
      return listCurveRows(finished, listSeries(), this.statistic);
    };
    const chartOptions = {
      ...options,
      note: runs > 1 ? `${experiment.name}: ${this.describeBands()}` : `${experiment.name}: 1 run`,
      x: this.x,
      xLabel: "generation",
      onPick: ({ x, run, label }) => {
        if (!this.earlierRuns.some(({ name }) => name === label)) this.pick(x, run);
      },
      series: listSeries(),
    };
    const columns = ["curve", "generation", this.statistic, "low", "high"];
    const chart = addChart(root, chartOptions, { name, columns, rows, file });
    this.charts.push({ chart, listSeries });
  }

  listFitnessSeries() {
    if (this.species.length) return this.listSpeciesSeries("mean");
    return [
      ...this.listMeasureSeries("best agent", "best", selectSeriesStyle(0)),
      ...this.listMeasureSeries("average agent", "mean", selectSeriesStyle(1)),
      ...this.earlierRuns.map((run, number) => this.createEarlierSeries(run, number)),
    ];
  }

  /** Return the average agent of an earlier run, as a pale line. */
  createEarlierSeries({ name, values }, number) {
    return {
      label: name,
      color: palette["line-strong"],
      dash: EARLIER_DASHES[number],
      values: this.x.map((generation) => values[generation] ?? null),
    };
  }

  listShareSeries() {
    if (this.species.length) return this.listSpeciesSeries("share");
    const { name } = this.feed.summary.measures.share;
    return this.listMeasureSeries(name, "share", selectSeriesStyle(2));
  }

  /** Return a series for each species, in its color on the map. */
  listSpeciesSeries(measure) {
    return this.species.flatMap(({ name, color }) =>
      this.listMeasureSeries(name, `${measure}:${name}`, { color: resolveColor(color) })
    );
  }

  /**
   * Return the mean of a measure, or its quantiles.
   * @returns {import("../charts/charts.js").Series[]}
   */
  listMeasureSeries(label, measure, style) {
    if (this.statistic === "mean") return [this.createSeries(label, measure, style)];
    const runs = this.feed.bands[measure]?.runs ?? [];
    const padded = this.x.map((generation) => runs[generation] ?? null);
    const [median, band] = createQuantileSeries(label, style.color, padded);
    return [{ ...median, runs: this.createSeries(label, measure, style).runs }, band];
  }

  /** Return the series of a measure. It is null in generations that are not finished. */
  createSeries(label, measure, { color }) {
    const { mean, low, high, runs: runValues = [] } = this.feed.bands[measure] ?? { mean: [] };
    const pad = (values) => values && this.x.map((generation) => values[generation] ?? null);
    const runCount = this.runSwitch.checked ? this.feed.summary.runs : 0;
    const runLines = Array.from({ length: runCount }, (_, run) => ({
      run,
      values: pad(runValues.map((values) => values[run])),
    }));
    return {
      label,
      color,
      values: pad(mean),
      low: pad(low),
      high: pad(high),
      runs: runLines,
    };
  }

  /** Draw the curves once per frame, independent of the number of messages. */
  update() {
    this.frame ||= requestAnimationFrame(() => this.draw());
  }

  draw() {
    this.frame = 0;
    for (const { chart, listSeries } of this.charts) chart.update(this.x, listSeries());
  }

  close() {
    cancelAnimationFrame(this.frame);
    for (const { chart } of this.charts) chart.destroy();
  }
}

const MAX_RUNS = 3;
const MAX_NAMED_CHANGES = 3;

/** @type {{name: string, values: number[]}[]} the most recent run is the last */
const earlier = [];

/** Return the most recent runs, with the mean of the average agent in each generation. */
export function listEarlierRuns() {
  return [...earlier];
}

/** Remember the curve of a run that the page no longer shows. */
export function rememberRun(name, values) {
  if (!values.length) return;
  const previous = earlier.findIndex((run) => run.name === name);
  // The same settings with the same seed give the same curve.
  if (previous >= 0) earlier.splice(previous, 1);
  earlier.push({ name, values });
  if (earlier.length > MAX_RUNS) earlier.shift();
}

/**
 * Return the name of an experiment with its changes, for example "evo+self-taught/A, rule: none".
 * @param {Object<string, any>} experiment
 */
export async function nameExperiment(experiment) {
  const { name } = experiment;
  const { presets } = await getJSON("api/presets");
  // The user has given it another name.
  if (!presets.some((preset) => preset.name === name)) return name;
  const base = await getJSON(`api/preset?${new URLSearchParams({ name })}`);
  const changes = Object.entries(findChanges(experiment, base));
  const parts = changes.slice(0, MAX_NAMED_CHANGES).map(([path, value]) => describe(path, value));
  const rest = changes.length - parts.length;
  return [name, ...parts, ...(rest > 0 ? [`${rest} more changes`] : [])].join(", ");
}

function describe(path, value) {
  const label = path.split(".").at(-1).replaceAll("_", " ");
  return `${label}: ${typeof value === "object" ? "changed" : value}`;
}
