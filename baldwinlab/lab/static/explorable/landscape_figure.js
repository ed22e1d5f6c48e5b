/** Learning on rugged landscapes: it hides and guides at once, and a fork shows both. */

import { el, formatNumber } from "../core/common.js";
import { RunFigure } from "./figure.js";
import { createClimbers } from "./landscape_model.js";
import { TrendChart } from "./trend_chart.js";

export class LandscapeFigure extends RunFigure {
  constructor(root, context) {
    super(root, context);
    this.climbers = this.data.climbers;
    this.generations = this.climbers.fork_generation + this.climbers.generations_after;
    this.interval = 60;
    const chart = el("div", { class: "chart tall" });
    root.append(chart, this.bar);
    const { strings } = this;
    this.chart = new TrendChart(chart, {
      title: strings.fitness_title,
      xLabel: strings.x_label,
      xMax: this.generations - 1,
      yMin: 40,
      yMax: 100,
      series: [
        { name: "died", label: strings.after_learning, color: "learned" },
        { name: "born", label: strings.at_birth, color: "innate" },
        { name: "control", label: strings.never, color: "control" },
      ],
    });
  }

  start() {
    const { settings, landscapes } = this.climbers;
    const changed = { ...settings, k: this.dials.read("k") };
    this.pairs = Array.from(
      { length: landscapes },
      (_, run) => createClimbers(changed, this.data.seed, run),
    );
    this.chart.startRun(this.describeRun());
    for (const name of ["hidden", "guided"]) this.setValue(name, this.strings.waiting);
  }

  advance(generation) {
    const { fork_generation: fork } = this.climbers;
    if (generation === fork) {
      this.chart.mark(fork, this.strings.learning_off);
      for (const { learners } of this.pairs) learners.stopLearning();
    }
    const results = this.pairs.map(({ learners, control }) => [learners.next(), control.next()]);
    const average = (read) =>
      (100 * results.reduce((sum, result) => sum + read(result), 0)) / results.length;
    this.chart.add("born", average(([learners]) => learners.born));
    this.chart.add("control", average(([, control]) => control.born));
    if (generation < fork) this.chart.add("died", average(([learners]) => learners.died));
    this.setValue("generation", String(generation));
    if (generation === fork - 1) this.setValue("hidden", this.formatDifference());
    if (generation === this.generations - 1) this.setValue("guided", this.formatDifference());
  }

  /** Return how much better learners are born than the others, in points. */
  formatDifference() {
    const difference = this.chart.read("born") - this.chart.read("control");
    return `${difference < 0 ? "−" : "+"}${formatNumber(Math.abs(difference))}`;
  }

  draw() {
    this.chart.draw();
  }
}
