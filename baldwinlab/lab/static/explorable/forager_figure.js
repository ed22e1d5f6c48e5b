/** The foragers again: learning is switched off, and three kinds of newborns are compared. */

import { el, formatDecimals, formatNumber, formatPercentage } from "../core/common.js";
import { formatColor } from "../core/palette.js";
import { Figure, formatText, wait } from "./figure.js";
import { TrendChart } from "./trend_chart.js";

// Milliseconds of a generation at normal speed.
const INTERVAL = 60;
// Runs that are simulated live after a change of a dial.
const LIVE_RUNS = 3;

export class ForagerFigure extends Figure {
  constructor(root, context) {
    super(root, context);
    const { curves } = this.data.recordings;
    this.curves = curves;
    this.generations = curves.alone[0].length;
    const chart = el("div", { class: "chart tall" });
    this.title = el("p", { class: "soft", role: "status" });
    root.append(chart, this.title, this.bar, this.createBars());
    const { strings } = this;
    this.setValue("hiding", formatPercentage(this.data.recordings.hiding));
    this.chart = new TrendChart(chart, {
      title: strings.items_title,
      xLabel: strings.x_label,
      xMax: this.generations - 1,
      yMax: 80,
      series: [
        { name: "learning", label: strings.learning, color: "learned" },
        { name: "born", label: strings.innate, color: "innate" },
        { name: "alone", label: strings.never, color: "control", isControl: true },
      ],
    });
  }

  /** Return bars: items of the same newborns that learn, do not learn, or have learned weights. */
  createBars() {
    const { newborns } = this.data.recordings;
    const most = Math.max(...Object.values(newborns));
    const colors = { learning: "learned", off: "innate", frozen: "text" };
    const rows = Object.entries(colors).map(([name, color]) =>
      el(
        "div",
        { class: "bar-row", style: `color: ${formatColor(color)}` },
        el("span", {}, this.strings[`newborns_${name}`]),
        el(
          "span",
          { class: "bar-space" },
          el("span", {
            class: "filled-bar",
            style: `width: ${(100 * newborns[name]) / most}%`,
          }),
        ),
        el("span", { class: "number" }, formatDecimals(newborns[name], 1)),
      )
    );
    const title = formatText(this.strings.newborns_title, {
      generation: this.data.fork_generation - 1,
    });
    return el("div", { class: "bars" }, el("div", { class: "chart-title" }, title), rows);
  }

  async run(mayContinue) {
    this.startRun();
    const isRecorded = this.dials.areUnchanged;
    const runs = isRecorded ? this.curves.alone.length : LIVE_RUNS;
    const text = isRecorded ? this.strings.recorded_runs : this.strings.live_runs;
    this.title.textContent = formatText(text, { runs });
    const learners = isRecorded ? null : await this.startLearners();
    for (let generation = 0; generation < this.generations; generation++) {
      if (!(await mayContinue())) return learners?.close();
      const start = performance.now();
      const live = await learners?.next(generation);
      // The reader can change a dial while a generation is simulated.
      if (!(await mayContinue())) return learners?.close();
      this.addGeneration(generation, runs, live);
      if (!this.isSkipping) await wait(INTERVAL / this.speed - (performance.now() - start));
    }
    learners?.close();
    this.end();
  }

  startRun() {
    this.fork = this.dials.read("fork");
    this.chart.startRun(this.describeRun());
    this.chart.mark(this.fork, this.strings.learning_off);
    for (const name of ["learning", "after", "alone"]) this.setValue(name, this.strings.waiting);
  }

  /** Return live learners. From the fork on, they evolve without learning. */
  async startLearners() {
    const runs = Array.from({ length: LIVE_RUNS }, (_, run) => run);
    const changes = { "learning.rate": this.dials.read("rate") };
    const source = /** @type {import("./source.js").LiveSource} */ (this.source);
    let population = await source.start("learning", changes, runs);
    return {
      next: async (generation) => {
        if (generation === this.fork) {
          const learners = population;
          population = await learners.fork({ "learning.rate": 0 });
          learners.close();
        }
        return population.next();
      },
      close: () => population.close(),
    };
  }

  /**
   * Show a generation. Without live means, the recorded runs are shown.
   * @param {number} generation
   * @param {number} runs
   * @param {number[]} [live] items of learners, one mean per run
   */
  addGeneration(generation, runs, live) {
    const average = (curves) =>
      curves.slice(0, runs).reduce((sum, curve) => sum + curve[generation], 0) / runs;
    const learners = live
      ? live.reduce((sum, mean) => sum + mean) / runs
      : average(this.curves.forked);
    const isLearning = generation < this.fork;
    this.chart.add(isLearning ? "learning" : "born", learners, generation);
    if (isLearning && !live) this.chart.add("born", average(this.curves.born), generation);
    const control = average(this.curves.alone);
    this.chart.add("alone", control, generation);
    if (isLearning) {
      this.setValue("learning", formatNumber(learners));
      this.setValue("alone", formatNumber(control));
    } else if (generation === this.fork) this.setValue("after", formatNumber(learners));
  }

  showStill() {
    if (!this.isNew) return;
    const runs = this.curves.alone.length;
    this.chart.clear();
    this.fork = this.dials.read("fork");
    this.chart.mark(this.fork, this.strings.learning_off);
    this.title.textContent = formatText(this.strings.recorded_runs, { runs });
    for (let generation = 0; generation < this.generations; generation++)
      this.addGeneration(generation, runs);
    this.chart.draw();
  }
}
