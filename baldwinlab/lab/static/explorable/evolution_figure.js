/** Evolution: a map plays a lifetime of each generation, and a curve grows. */

import { el, formatNumber } from "../core/common.js";
import { createPlayer, Figure, formatText } from "./figure.js";
import { MapView } from "./map_view.js";
import { TrendChart } from "./trend_chart.js";

// Speed of the player at normal speed: a fifth of a second per lifetime.
const FAST_SPEED = 500;

export class EvolutionFigure extends Figure {
  constructor(root, context, yMax = 20) {
    super(root, context);
    this.player = createPlayer((time) => {
      this.map.draw(time);
      return true;
    });
    this.setSpeed(this.speed);
    this.map = new MapView(this.strings, "", () => this.player.invalidate(), this.region);
    this.generations = this.data.evolution_generations;
    const chart = el("div", { class: "chart" });
    root.append(el("div", { class: "map-and-chart" }, this.map.root, chart), this.bar);
    const { alone, learning, items_title: title, x_label: xLabel } = this.strings;
    this.chart = new TrendChart(chart, {
      title,
      xLabel,
      xMax: this.generations - 1,
      yMax,
      series: [
        { name: "learning", label: learning, color: "learned" },
        { name: "alone", label: alone, color: "control" },
      ],
    });
  }

  /** The shown part of the map. */
  get region() {
    return this.data.region;
  }

  /** The curve of the run. */
  get curve() {
    return "alone";
  }

  setSpeed(speed) {
    super.setSpeed(speed);
    this.player.speed = FAST_SPEED * speed;
  }

  onPlaying(isPlaying) {
    if (isPlaying && this.map.recording) this.player.play();
    else this.player.pause();
  }

  skip() {
    super.skip();
    // The lifetime that plays ends now.
    this.player.ended();
  }

  async run(mayContinue) {
    // A lifetime of the previous round ends.
    this.player.ended();
    this.chart.startRun(this.describeRun());
    const { curve } = this;
    const population = await this.startPopulation();
    const [run] = population.runs;
    for (let generation = 0; generation < this.generations; generation++) {
      if (!(await mayContinue())) return population.close();
      const [mean] = await population.next();
      const isLast = generation === this.generations - 1;
      const life = this.isSkipping && !isLast ? null : await population.recordLife(run, generation);
      if (!(await mayContinue())) return population.close();
      this.addGeneration(curve, generation, mean);
      if (life) await this.playLife(life);
    }
    population.close();
    this.end();
  }

  startPopulation() {
    const changes = {
      "population.size": this.dials.read("agents"),
      "evolution.mutation_rate": this.dials.read("mutation_rate") / 100,
    };
    return this.source.start("alone", changes, [this.data.first_life.run]);
  }

  addGeneration(curve, generation, mean) {
    this.chart.add(curve, mean);
    this.map.caption.textContent = formatText(this.strings.generation, { generation });
    this.setValue("generation", String(generation));
    this.setValue("mean", formatNumber(mean));
  }

  /** Play a lifetime. Resolves at its end. */
  playLife(life) {
    this.map.show(life);
    this.player.last = life.last - 1;
    this.player.time = 0;
    this.onPlaying(this.isPlaying);
    return new Promise((resolve) => (this.player.ended = resolve));
  }

  showStill() {
    const life = this.recorded.lives.get("alone");
    if (!this.isNew || !life) return;
    const means = this.data.recordings.curves.alone[this.data.first_life.run];
    this.chart.clear();
    means.slice(0, this.generations).forEach((mean, generation) =>
      this.addGeneration("alone", generation, mean)
    );
    this.map.show(life);
    this.player.time = life.last - 1;
    this.map.draw(this.player.time);
    this.chart.draw();
  }
}
