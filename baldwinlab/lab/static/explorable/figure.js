/** A picture of the essay, which plays while it is in sight, with its maps and dials. */

import { createButton, el, formatNumber, setText } from "../core/common.js";
import { WorldView } from "../world/world_view.js";
import { Player } from "../world/player.js";

// Milliseconds after the last change of a dial.
const DIAL_DELAY = 200;

/**
 * @typedef {object} Context
 * @property {import("./source.js").LiveSource|import("./source.js").RecordedSource} source
 * @property {import("./source.js").RecordedSource} recorded
 * @property {import("./source.js").PageData} data
 * @property {Dials} dials of the step
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
    this.wantsPlay = !matchMedia("(prefers-reduced-motion: reduce)").matches;
    // Continue when the figure plays again.
    this.waiting = [];
    // Counts the runs. A loop ends when it is no longer the newest.
    this.round = 0;
    // Whether a run starts when the figure plays.
    this.isNew = true;
    this.button = createButton("", () => this.toggle(), { class: "play" });
    this.bar = el("div", { class: "picture-bar" }, this.button);
    this.showButton();
    let timer = 0;
    this.dials.listen(() => {
      clearTimeout(timer);
      timer = setTimeout(() => this.restart(), DIAL_DELAY);
    });
  }

  get isPlaying() {
    return this.wantsPlay && this.isInSight && !document.hidden;
  }

  /** Play or pause, as the page scrolls. */
  setInSight(isInSight) {
    this.isInSight = isInSight;
    this.update();
  }

  toggle() {
    if (this.hasEnded) return this.restart();
    this.wantsPlay = !this.wantsPlay;
    this.update();
  }

  /** Start again with the current numbers of the dials. */
  restart() {
    this.hasEnded = false;
    this.wantsPlay = true;
    this.update();
    this.play();
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
    this.showButton();
  }

  showButton() {
    const { play, pause, restart } = this.labels;
    this.button.textContent = this.hasEnded ? restart : this.wantsPlay ? pause : play;
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

  /** Show a still picture: recorded results, for paper and reduced motion. Overridden. */
  async showStill() {}
}

/** Insert values into a text with {name}. */
export function formatText(text, values) {
  return text.replace(/\{(\w+)\}/g, (_, name) => values[name]);
}

export class Dials {
  /**
   * @param {HTMLElement} section
   * @param {(name: string, value: number) => string} format shows a number
   */
  constructor(section, format) {
    /** @type {Map<string, HTMLInputElement>} */
    this.inputs = new Map();
    this.format = format;
    const inputs = /** @type {NodeListOf<HTMLInputElement>} */ (
      section.querySelectorAll("[data-dial]")
    );
    for (const input of inputs) {
      this.inputs.set(input.dataset.dial, input);
      input.addEventListener("input", () => this.show(input));
      this.show(input);
    }
  }

  show(input) {
    const text = this.format(input.dataset.dial, Number(input.value));
    input.previousElementSibling.textContent = text;
    input.setAttribute("aria-valuetext", text);
  }

  read(name) {
    return Number(this.inputs.get(name).value);
  }

  /** Call a function after each change. */
  listen(changed) {
    for (const input of this.inputs.values()) input.addEventListener("input", changed);
  }

  disable() {
    for (const input of this.inputs.values()) input.disabled = true;
  }
}

// Milliseconds between two pictures, which limits the load of a phone.
const FRAME_INTERVAL = 1000 / 20;
// Narrower maps have no trails, which take half of the time of a picture.
const MIN_TRAIL_WIDTH = 420;

/** Return a player for the maps of a figure. */
export function createPlayer(speed, show) {
  const player = new Player(show);
  player.setSpeed(speed);
  player.frameInterval = FRAME_INTERVAL;
  return player;
}

export class MapView {
  /**
   * @param {Object<string, string>} strings
   * @param {string} caption
   * @param {() => void} invalidate called when the map must be drawn again
   */
  constructor(strings, caption, invalidate) {
    this.strings = strings;
    this.recording = null;
    this.agent = null;
    const label = formatText(strings.map, { name: caption });
    this.canvas = el("canvas", { role: "img", "aria-label": label });
    this.view = new WorldView(this.canvas);
    this.count = el("span", { class: "number" }, strings.waiting);
    this.caption = el("span", {}, caption);
    const foot = el("figcaption", {}, this.caption, " ", this.count);
    this.root = el("figure", { class: "map" }, this.canvas, foot);
    this.view.followSize(invalidate);
  }

  /**
   * @param {import("../world/recording.js").Recording} recording
   * @param {number|null} agent gets a ring
   */
  show(recording, agent = null) {
    this.recording = recording;
    this.agent = agent;
  }

  /** Show a world without agents. */
  showWorld(world, appearance) {
    this.recording = null;
    this.view.setWorld({ world, appearance });
    this.count.textContent = "";
    this.draw(0);
  }

  /**
   * Draw a shape on the map that is not part of the world yet.
   * @param {string} color
   * @param {number[]} shape its left, right, upper and lower edge
   */
  showSketch(color, shape) {
    const [left, right, upper, lower] = shape;
    const { marks } = this.view.world;
    const sketch = { kind: "rectangle", x: left, y: upper, color, label: "", solid: false };
    this.view.world.marks = [...marks, { ...sketch, width: right - left, height: lower - upper }];
    this.view.draw(null, 0);
    this.view.world.marks = marks;
  }

  draw(time) {
    const { recording, agent } = this;
    if (!recording) {
      this.view.draw(null, 0);
      return;
    }
    const moment = Math.min(time, recording.last - 1);
    const trails = this.view.width < MIN_TRAIL_WIDTH ? "off" : "recent";
    this.view.draw(recording, moment, { selectedAgent: agent, trails });
    const items = formatNumber(this.countItems(moment));
    setText(this.count, formatText(this.strings.eaten, { items }));
  }

  /** Return the number of items that all agents have eaten. */
  countItems(time) {
    return this.recording.countAllEaten(Math.floor(time) + 1).items;
  }
}

/** Return the agent that eats most in its life. */
export function findBestAgent(recording) {
  const eaten = Array.from(
    { length: recording.agents },
    (_, agent) => recording.countEaten(recording.last, agent),
  );
  return eaten.indexOf(Math.max(...eaten));
}
