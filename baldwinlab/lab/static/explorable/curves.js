/** Curves of the essay: the mean number of eaten items per agent, by generation. */

import { LineChart } from "../charts/charts.js";
import { selectSeriesStyle } from "../charts/chart_series.js";
import { computeMean } from "../charts/quantiles.js";

const HEIGHT = 280;

export class Curves {
  /**
   * @param {HTMLElement} root is filled
   * @param {Object<string, string>} strings
   * @param {string} title
   * @param {string[]} names of the curves
   * @param {number} generations of the x axis
   */
  constructor(root, strings, title, names, generations) {
    this.strings = strings;
    this.names = names;
    this.x = Array.from({ length: generations }, (_, generation) => generation);
    this.clear();
    const { x_label: xLabel, y_label: yLabel, run: runLabel } = strings;
    const options = { title, xLabel, yLabel, runLabel, height: HEIGHT };
    this.chart = new LineChart(root, { ...options, x: this.x, series: this.listSeries() });
    this.frame = 0;
  }

  /** Remove all points. */
  clear() {
    // By curve: [generation][run].
    this.points = Object.fromEntries(this.names.map((name) => [name, []]));
  }

  /** Add a generation: the values of the runs. */
  add(name, values) {
    this.points[name].push(values);
    this.frame ||= requestAnimationFrame(() => this.draw());
  }

  draw() {
    this.frame = 0;
    this.chart.update(this.x, this.listSeries());
  }

  /** Return the mean over runs in the last `count` generations before `end`, or null. */
  computeMean(name, count, end = this.points[name].length) {
    const points = this.points[name].slice(Math.max(0, end - count), end);
    return points.length ? computeMean(points.map(computeMean)) : null;
  }

  listSeries() {
    return this.names.map((name, number) => {
      const points = this.points[name];
      const runs = points[0]?.length ?? 0;
      const pad = (read) => this.x.map((g) => (g < points.length ? read(points[g]) : null));
      const runLines = Array.from({ length: runs > 1 ? runs : 0 }, (_, run) => ({
        run,
        values: pad((values) => values[run]),
      }));
      const { color, dash } = selectSeriesStyle(number);
      return { label: this.strings[name], color, dash, values: pad(computeMean), runs: runLines };
    });
  }
}
