/** A picture of the essay, which plays while it is in sight, with its controls. */

import { createButton, createSelect, el } from "../core/common.js";
import { Player } from "../world/player.js";

// Milliseconds after the last change of a dial.
const DIAL_DELAY = 200;
// Factors of the speed, with their texts.
const SPEEDS = { slow: 0.5, normal: 1, fast: 5 };
// Milliseconds of computation between two pictures, while a run goes to its end.
const MAX_COMPUTATION = 40;

/**
 * @typedef {object} Context
 * @property {import("./source.js").LiveSource|import("./source.js").RecordedSource} source
 * @property {import("./source.js").RecordedSource} recorded
 * @property {import("./source.js").PageData} data
 * @property {import("./dials.js").Dials} dials of the step
 * @property {(name: string, text: string) => void} setValue shows a value in the text of the step
 */
export class Figure {
  /**
   * @param {HTMLElement} root is filled
   * @param {Context} context
   */
  constructor(root, context) {
    this.root = root;
    this.source = context.source;
    this.recorded = context.recorded;
    this.data = context.data;
    this.dials = context.dials;
    this.setValue = context.setValue;
    this.isInSight = false;
    this.hasEnded = false;
    this.labels = this.data.strings.labels;
    this.strings = this.data.strings.figures;
    this.runLabels = this.data.strings.runs;
    this.wantsPlay = !matchMedia("(prefers-reduced-motion: reduce)").matches;
    // Continue when the figure plays again.
    this.waiting = [];
    // Counts the runs. A loop ends when it is no longer the newest.
    this.round = 0;
    // Whether a run starts when the figure plays.
    this.isNew = true;
    this.speed = SPEEDS.normal;
    // Whether the run goes to its end without pauses.
    this.isSkipping = false;
    this.bar = this.createBar();
    this.showButton();
    let timer = 0;
    this.dials.listen(() => {
      clearTimeout(timer);
      timer = setTimeout(() => this.restart(), DIAL_DELAY);
    });
  }

  createBar() {
    const { labels } = this;
    this.button = createButton("", () => this.toggle(), { class: "play" });
    this.endButton = createButton(labels.end, () => this.skip(), { class: "end" });
    const speeds = Object.keys(SPEEDS).map((name) => [name, labels[name]]);
    const speed = createSelect(speeds, "normal", (name) => this.setSpeed(SPEEDS[name]), {
      "aria-label": labels.speed,
    });
    return el("div", { class: "picture-bar" }, this.button, speed, this.endButton);
  }

  get isPlaying() {
    // A run goes to its end also if more of another picture is in sight.
    return this.wantsPlay && (this.isInSight || this.isSkipping) && !document.hidden;
  }

  /** Play or pause, as the page scrolls. */
  setInSight(isInSight) {
    this.isInSight = isInSight;
    this.update();
  }

  setSpeed(speed) {
    this.speed = speed;
  }

  toggle() {
    // The pressed button is in sight, also if more of another picture is.
    this.isInSight = true;
    if (this.hasEnded) return this.restart();
    this.wantsPlay = !this.wantsPlay;
    this.update();
  }

  /** Start again with the current numbers of the dials. */
  restart() {
    this.hasEnded = this.isSkipping = false;
    this.wantsPlay = true;
    this.update();
    this.play();
  }

  /** Show the end of the run. */
  skip() {
    this.isSkipping = this.wantsPlay = true;
    this.update();
  }

  /** Run a new round, and show that it failed. */
  async play() {
    this.isNew = false;
    const round = ++this.round;
    try {
      await this.run(() => this.whenPlaying(round));
    } catch {
      if (round === this.round) this.setStatus(this.strings.failed);
    }
  }

  update() {
    this.showButton();
    this.onPlaying(this.isPlaying);
    if (!this.isPlaying) return;
    if (this.isNew) this.play();
    this.waiting.splice(0).forEach((resolve) => resolve());
  }

  /** Wait until the figure plays. Return whether the round is still the newest. */
  async whenPlaying(round) {
    while (!this.isPlaying && round === this.round)
      await new Promise((resolve) => this.waiting.push(resolve));
    return round === this.round;
  }

  /** Show that the round is complete. */
  end() {
    this.hasEnded = true;
    this.isSkipping = false;
    this.showButton();
  }

  showButton() {
    const { play, pause, restart } = this.labels;
    this.button.textContent = this.hasEnded ? restart : this.wantsPlay ? pause : play;
    this.endButton.disabled = this.hasEnded || this.button.disabled;
  }

  /** Return the settings of a run for the labels of its curves, see `RunSettings`. */
  describeRun() {
    return this.dials.list().map(([name, text]) => {
      const kind = text === this.strings.never_changes ? "never" : name;
      return [text, formatText(this.runLabels[kind], { value: text })];
    });
  }

  setStatus(text) {
    this.bar.append(el("p", { class: "warning", role: "status" }, text));
  }

  /**
   * Simulate and draw. Overridden.
   * @param {() => Promise<boolean>} _mayContinue waits while the figure is paused
   */
  async run(_mayContinue) {}

  /** React to play and pause. Overridden. */
  onPlaying(_isPlaying) {}

  /** Show a still picture at once: recorded results, for paper and reduced motion. Overridden. */
  showStill() {}
}

/** A picture of a run whose generations are computed on the page, one by one. */
export class RunFigure extends Figure {
  // Milliseconds between two generations at normal speed.
  interval = 50;
  // Number of generations.
  generations = 1;

  /** Prepare a run. Overridden. */
  start() {}

  /** Compute and show a generation. Overridden. */
  advance(_generation) {}

  /** Show the results of the run. Overridden. */
  finish() {}

  /** Draw at once. Overridden. */
  draw() {}

  async run(mayContinue) {
    this.start();
    let lastPause = performance.now();
    for (let generation = 0; generation < this.generations; generation++) {
      if (!(await mayContinue())) return;
      this.advance(generation);
      if (this.isSkipping && performance.now() - lastPause < MAX_COMPUTATION) continue;
      await wait(this.isSkipping ? 0 : this.interval / this.speed);
      lastPause = performance.now();
    }
    this.finish();
    this.end();
  }

  showStill() {
    if (!this.isNew) return;
    this.start();
    for (let generation = 0; generation < this.generations; generation++) this.advance(generation);
    this.finish();
    this.draw();
  }
}

export function wait(milliseconds) {
  return new Promise((resolve) => setTimeout(resolve, milliseconds));
}

/** Insert values into a text with {name}. */
export function formatText(text, values) {
  return text.replace(/\{(\w+)\}/g, (_, name) => values[name]);
}

// Milliseconds between two pictures, which limits the load of a phone.
const FRAME_INTERVAL = 1000 / 20;

/** Return a player for the maps of a figure. */
export function createPlayer(show) {
  const player = new Player(show);
  player.frameInterval = FRAME_INTERVAL;
  return player;
}
