/** Pictures of evolution: a map with a curve, curves of several populations, and the fork. */

import { el, formatNumber } from "../core/common.js";
import { createPlayer, Figure, formatText, MapView } from "./figure.js";
import { LineChart } from "../charts/charts.js";
import { selectSeriesStyle } from "../charts/chart_series.js";
import { computeMean } from "../charts/quantiles.js";

// Steps per second are ten times this number: half a second per lifetime.
const FAST_SPEED = 200;

/** Evolution without learning: each generation lives on the map, and the curve grows. */
export class EvolutionFigure extends Figure {
  /** @param {string} [name] of the curve */
  constructor(root, context, name = "alone") {
    super(root, context);
    this.player = createPlayer(FAST_SPEED, (time) => {
      this.map.draw(time);
      return true;
    });
    this.map = new MapView(this.strings, "", () => this.player.invalidate());
    const chart = el("div", { class: "chart" });
    root.append(el("div", { class: "map-and-chart" }, this.map.root, chart), this.bar);
    const { alone } = this.data.recordings.curves;
    const title = this.strings.curve_title;
    this.curves = new Curves(chart, this.strings, title, [name], alone[0].length);
  }

  onPlaying(isPlaying) {
    if (isPlaying && this.map.recording) this.player.play();
    else this.player.pause();
  }

  async run(mayContinue) {
    // A lifetime of the previous round ends.
    this.player.ended();
    this.curves.clear();
    const population = await this.startPopulation();
    const [run] = population.runs;
    for (let generation = 0; generation < this.curves.x.length; generation++) {
      if (!(await mayContinue())) return population.close();
      const means = await population.next();
      const life = await population.recordLife(run, generation);
      if (!(await mayContinue())) return population.close();
      this.addGeneration(generation, means);
      await this.playLife(life);
    }
    this.end();
  }

  startPopulation() {
    const changes = {
      "population.size": this.dials.read("agents"),
      "evolution.mutation_rate": this.dials.read("mutation_rate") / 100,
    };
    return this.source.start("alone", changes, [this.data.first_life.run]);
  }

  addGeneration(generation, means) {
    this.curves.add(this.curves.names[0], means);
    this.map.caption.textContent = formatText(this.strings.generation, { generation });
    this.setValue("generation", String(generation));
    this.setValue("mean", formatNumber(means[0]));
  }

  /** Play a lifetime. Resolves at its end. */
  playLife(life) {
    this.map.show(life);
    this.player.last = life.last - 1;
    this.player.time = 0;
    this.onPlaying(this.isPlaying);
    return new Promise((resolve) => (this.player.ended = resolve));
  }

  async showStill() {
    if (!this.isNew) return;
    const curve = this.data.recordings.curves.alone[this.data.first_life.run];
    curve.forEach((mean, generation) => this.addGeneration(generation, [mean]));
    this.map.show(await this.recorded.loadLife("alone"));
    this.player.time = this.map.recording.last - 1;
    this.map.draw(this.player.time);
    this.curves.draw();
  }
}

const NAMES = ["alone", "learning"];

/** The curves of populations that evolve side by side, by default with and without learning. */
export class CurvesFigure extends Figure {
  constructor(root, context, names = NAMES, generations = context.data.fork_generation) {
    super(root, context);
    this.names = names;
    this.generations = generations;
    const chart = el("div");
    root.append(chart, this.bar);
    const title = formatText(this.strings.curves_title, { runs: this.data.runs });
    this.curves = new Curves(chart, this.strings, title, names, generations);
  }

  listRuns() {
    const runs = this.dials.inputs.has("runs") ? this.dials.read("runs") : this.data.runs;
    return Array.from({ length: runs }, (_, run) => run);
  }

  /** Return the source of a curve. A browser cannot simulate the yoked control. */
  findSource(name) {
    return name === "yoked" ? this.recorded : this.source;
  }

  /** Return the changed settings of a curve. */
  listChanges(name) {
    return name === "alone" || !this.dials.inputs.has("rate")
      ? {}
      : { "learning.rate": this.dials.read("rate") };
  }

  async run(mayContinue) {
    const runs = this.listRuns();
    const title = formatText(this.strings.curves_title, { runs: runs.length });
    this.root.querySelector(".chart-title").textContent = title;
    this.curves.clear();
    const populations = {};
    for (const name of this.names)
      populations[name] = await this.findSource(name).start(name, this.listChanges(name), runs);
    for (let generation = 0; generation < this.generations; generation++) {
      for (const name of this.names) {
        if (!(await mayContinue())) return closeAll(populations);
        await this.beforeGeneration(populations, name, generation);
        this.curves.add(name, await populations[name].next());
      }
      this.showValues(generation);
    }
    closeAll(populations);
    this.end();
  }

  /** Change a population before a generation. Overridden. */
  async beforeGeneration(_populations, _name, _generation) {}

  /** Show the newest values in the text. */
  showValues(generation) {
    this.setValue("generation", String(generation));
    for (const name of this.names)
      this.setValue(name, formatNumber(this.curves.computeMean(name, 1)));
  }

  /** Return the recorded values of a curve: [run][generation]. */
  listRecorded(name) {
    return this.data.recordings.curves[name];
  }

  async showStill() {
    if (!this.isNew) return;
    for (const name of this.names) {
      const runs = this.listRecorded(name);
      for (let generation = 0; generation < this.generations; generation++)
        this.curves.add(
          name,
          runs.map((curve) => curve[generation]),
        );
    }
    this.curves.draw();
    this.showValues(this.generations - 1);
  }
}

function closeAll(populations) {
  for (const population of Object.values(populations)) population.close();
}

/** Learning and its controls. */
export class ControlsFigure extends CurvesFigure {
  constructor(root, context) {
    super(root, context, ["alone", "learning", "random", "yoked"]);
  }
}

/** Both populations evolve on without learning. */
export class ForkFigure extends CurvesFigure {
  constructor(root, context) {
    super(root, context, NAMES, context.data.recordings.curves.alone[0].length);
  }

  get fork() {
    return this.source.isLive ? this.dials.read("fork") : this.data.fork_generation;
  }

  async beforeGeneration(populations, name, generation) {
    if (name !== "learning" || generation !== this.fork) return;
    const learners = populations.learning;
    populations.learning = await learners.fork({ "learning.rate": 0 });
    learners.close();
  }

  listRecorded(name) {
    return super.listRecorded(name === "learning" ? "forked" : name);
  }

  showValues(generation) {
    const { fork, curves } = this;
    const show = (name, value) => this.setValue(name, formatNumber(value));
    const count = this.data.last_generations;
    if (generation < fork) return;
    show("before", curves.computeMean("learning", 1, fork));
    show("after", curves.computeMean("learning", 1, fork + 1));
    if (generation === this.generations - 1) {
      for (const name of this.names) show(name, curves.computeMean(name, count));
    }
  }
}

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
