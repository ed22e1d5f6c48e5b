/** Pictures of lifetimes: agents that look for food, and the same agents with learning off. */

import { el } from "../core/common.js";
import { createPlayer, Figure, findBestAgent, MapView } from "./figure.js";

// Steps per second are ten times this number.
const LIFE_SPEED = 10;
// The step of a still picture, as a share of a lifetime.
const STILL_SHARE = 0.6;

/** Maps that play lifetimes together, again and again. */
class LifeFigure extends Figure {
  constructor(root, context, captions) {
    super(root, context);
    this.player = createPlayer(LIFE_SPEED, (time) => this.draw(time));
    this.player.ended = () => this.showNextLife();
    const invalidate = () => this.player.invalidate();
    this.maps = captions.map((caption) => new MapView(this.strings, caption, invalidate));
    root.append(el("div", { class: "maps" }, ...this.maps.map((map) => map.root)), this.bar);
    matchMedia("(prefers-color-scheme: dark)").addEventListener("change", invalidate);
    this.population = null;
  }

  onPlaying(isPlaying) {
    if (isPlaying && this.maps[0].recording) this.player.play();
    else this.player.pause();
  }

  draw(time) {
    for (const map of this.maps) map.draw(time);
    this.showValues(time);
    return true;
  }

  show(recordings) {
    recordings.forEach((recording, index) => this.maps[index].show(recording));
    this.player.last = recordings[0].last - 1;
    this.player.time = 0;
    this.player.invalidate();
    this.onPlaying(this.isPlaying);
  }

  /** Return the learners, evolved up to the generation of the first life. */
  async evolve() {
    const { run, generation } = this.data.first_life;
    if (!this.population) {
      this.population = await this.source.start("learning", {}, [run]);
      while (this.population.generation <= generation) await this.population.next();
    }
    return this.population;
  }

  /**
   * Return the simulated lifetimes, one per map.
   * @abstract
   * @returns {Promise<import("../world/recording.js").Recording[]>}
   */
  loadLives() {
    throw new Error("A subclass defines the lifetimes.");
  }

  /**
   * Return the recorded lifetimes, one per map.
   * @abstract
   * @returns {Promise<import("../world/recording.js").Recording[]>}
   */
  loadRecordedLives() {
    throw new Error("A subclass defines the lifetimes.");
  }

  /** Show the numbers of a moment in the text. */
  showValues(_time) {}

  async run() {
    const round = this.round;
    const recordings = await this.loadLives();
    if (round === this.round) this.show(recordings);
  }

  /** Play the same lifetimes again. */
  showNextLife() {
    this.onPlaying(this.isPlaying);
  }

  async showStill() {
    if (this.isNew) this.show(await this.loadRecordedLives());
    if (!this.isPlaying) {
      this.player.time = Math.floor(this.player.last * STILL_SHARE);
      this.draw(this.player.time);
    }
  }
}

/** The first picture: one agent of a population has a ring. */
export class AgentFigure extends LifeFigure {
  constructor(root, context) {
    super(root, context, [""]);
    this.isFirstLife = true;
  }

  loadRecordedLives() {
    return Promise.all([this.recorded.loadLife("learning")]);
  }

  /** The first life is recorded, so that it plays at once. A live one follows. */
  async loadLives() {
    if (this.isFirstLife) {
      this.isFirstLife = false;
      return this.loadRecordedLives();
    }
    const { run, generation } = this.data.first_life;
    const population = await this.evolve();
    const changes = {
      "senses.visual_radius": this.dials.read("visual_radius"),
      "world.food.0.count": this.dials.read("food"),
    };
    return [await population.recordLife(run, generation, changes)];
  }

  show(recordings) {
    super.show(recordings);
    this.maps[0].agent = findBestAgent(recordings[0]);
  }

  showNextLife() {
    this.play();
  }

  showValues(time) {
    const { recording, agent } = this.maps[0];
    if (recording)
      this.setValue("ring_items", String(recording.countEaten(Math.floor(time) + 1, agent)));
  }
}

/** The same lifetimes with learning on and off. */
export class LearningFigure extends LifeFigure {
  constructor(root, context) {
    const { on, off } = context.data.strings.figures;
    super(root, context, [on, off]);
  }

  loadRecordedLives() {
    return Promise.all(["learning", "off"].map((name) => this.recorded.loadLife(name)));
  }

  async loadLives() {
    const { run, generation } = this.data.first_life;
    const population = await this.evolve();
    const rates = [this.dials.read("rate"), 0];
    const lives = [];
    for (const rate of rates)
      lives.push(await population.recordLife(run, generation, { "learning.rate": rate }));
    return lives;
  }

  showValues(time) {
    const [on, off] = this.maps;
    if (!on.recording) return;
    this.setValue("on", String(on.countItems(time)));
    this.setValue("off", String(off.countItems(time)));
  }
}
