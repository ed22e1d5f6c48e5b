/** Strings of switches that guess: runs of Hinton and Nowlan, and of a world that changes. */

import { el, formatNumber, formatPercentage } from "../core/common.js";
import { palette } from "../core/palette.js";
import { formatText, RunFigure } from "./figure.js";
import { computeBalance, NeedlePopulation, OPEN } from "./needle_model.js";
import { TrendChart } from "./trend_chart.js";

// Rows of the picture: the first strings of the population.
const SHOWN_STRINGS = 100;

/** A run of strings. The first strings are rows of three colors, next to charts. */
class StringFigure extends RunFigure {
  constructor(root, context) {
    super(root, context);
    this.needle = this.data.needle;
    this.canvas = el("canvas", {
      class: "strings",
      role: "img",
      "aria-label": this.strings.strings,
      width: this.needle.settings.loci,
      height: SHOWN_STRINGS,
    });
    this.charts = el("div", { class: "charts" });
    root.append(el("div", { class: "strings-and-charts" }, this.canvas, this.charts), this.bar);
    // Each run has other random numbers.
    this.runs = 0;
    this.population = null;
    matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => this.drawStrings());
  }

  createChart(options) {
    const xLabel = this.strings.x_label;
    return new TrendChart(this.charts, { xLabel, xMax: this.generations - 1, ...options });
  }

  /** Return the settings of a run. Overridden. */
  listSettings() {
    return this.needle.settings;
  }

  start() {
    this.population = new NeedlePopulation(this.listSettings(), this.data.seed, this.runs);
    this.runs += 1;
    this.setValue("run", formatNumber(this.runs));
  }

  /** Start a run in a chart. Its number tells it apart from runs with equal settings. */
  startChart(chart) {
    chart.startRun(this.describeRun(), formatText(this.runLabels.run, { value: this.runs }));
  }

  /** Simulate a generation and show it. Return its means. */
  simulate(generation) {
    const means = this.population.next();
    this.drawStrings();
    this.setValue("generation", String(generation));
    this.setValue("open", formatPercentage(means.open));
    this.setValue("right", formatPercentage(means.right));
    this.setValue("trials_used", formatNumber(Math.round(means.trials)));
    return means;
  }

  drawStrings() {
    if (!this.population) return;
    const { genomes, target } = this.population;
    const { width, height } = this.canvas;
    const pen = this.canvas.getContext("2d");
    for (let row = 0; row < height; row++) {
      for (let locus = 0; locus < width; locus++) {
        const allele = genomes[row * width + locus];
        const kind = allele === OPEN ? "learned" : allele === target[locus] ? "innate" : "wrong";
        pen.fillStyle = palette[kind];
        pen.fillRect(locus, row, 1, 1);
      }
    }
  }

  /** The first run that plays is the one of the still picture. */
  showStill() {
    if (!this.isNew) return;
    super.showStill();
    this.runs = 0;
  }
}

/** Hinton and Nowlan: learned switches become innate. */
export class PuzzleFigure extends StringFigure {
  constructor(root, context) {
    super(root, context);
    this.generations = this.needle.puzzle_generations;
    this.interval = 150;
    const { strings } = this;
    this.shares = this.createChart({
      title: strings.shares_title,
      yMax: 100,
      series: [
        { name: "right", label: strings.right, color: "innate" },
        { name: "open", label: strings.open, color: "learned" },
        { name: "wrong", label: strings.wrong, color: "wrong" },
      ],
    });
    this.trials = this.createChart({
      title: strings.trials_title,
      yMax: 1000,
      series: [{ name: "trials", label: strings.trials, color: "learned" }],
    });
  }

  listSettings() {
    return { ...super.listSettings(), trials: this.needle.trials[this.dials.read("trials")] };
  }

  start() {
    super.start();
    this.startChart(this.shares);
    this.startChart(this.trials);
  }

  advance(generation) {
    const means = super.simulate(generation);
    for (const name of ["right", "open", "wrong"]) this.shares.add(name, 100 * means[name]);
    this.trials.add("trials", means.trials);
  }

  draw() {
    this.shares.draw();
    this.trials.draw();
  }
}

/** The same strings with a cost of guesses, in a world that changes. */
export class ChangingFigure extends StringFigure {
  constructor(root, context) {
    super(root, context);
    this.generations = this.needle.changing_generations;
    this.interval = 40;
    this.charts.classList.add("tall");
    const { strings } = this;
    this.chart = this.createChart({
      title: strings.shares_title,
      yMax: 60,
      series: [{ name: "open", label: strings.open, color: "learned" }],
    });
  }

  listSettings() {
    return {
      ...super.listSettings(),
      mutation_rate: this.needle.mutation_rate,
      cost: this.needle.costs[this.dials.read("cost")],
      period: this.needle.periods[this.dials.read("period")],
    };
  }

  start() {
    super.start();
    this.startChart(this.chart);
    const theory = computeBalance(this.listSettings());
    this.chart.reference = { y: 100 * theory, text: this.strings.theory, color: "text" };
    this.setValue("theory", formatPercentage(theory));
  }

  advance(generation) {
    this.chart.add("open", 100 * super.simulate(generation).open);
  }

  draw() {
    this.chart.draw();
  }
}
