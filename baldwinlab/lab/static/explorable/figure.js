/** A picture of the essay: it plays while it is in sight, and its button pauses it. */

import { createButton, el } from "../core/common.js";

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
