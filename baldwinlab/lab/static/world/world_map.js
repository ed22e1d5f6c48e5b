/** A world on the page: its canvas with zoom, its lifetime, and the selected agent. */

import { el, setText, Tooltip } from "../core/common.js";
import { FrameView } from "./frame_view.js";
import { bindGestures } from "./gestures.js";
import { WorldView } from "./world_view.js";

// Milliseconds until the map shows that a lifetime is loading.
const BUSY_DELAY = 150;

/**
 * @typedef {object} MapCallbacks
 * @property {() => void} invalidate called when the map must be drawn again
 * @property {(agent: number|null) => void} picked called when the user picks an agent, or none
 * @property {() => void} [moved] called after a change of the camera
 * @property {() => void} [loaded] called when another lifetime is shown
 * @property {(error: Error) => void} [failed]
 */
export class WorldMap {
  /**
   * @param {string} label
   * @param {string} testid
   * @param {MapCallbacks} callbacks
   */
  constructor(label, testid, callbacks) {
    this.callbacks = { moved: callbacks.invalidate, loaded() {}, failed() {}, ...callbacks };
    /** @type {import("../core/sources.js").Source|null} the lifetime that is shown or loading */
    this.source = null;
    /** @type {import("./recording.js").Life|null} */
    this.life = null;
    this.loadingLife = null;
    this.agent = null;
    // The recording and the step on the canvas, if it is not a frame.
    this.shown = null;
    this.canvas = el("canvas", {
      tabindex: 0,
      role: "img",
      "aria-label": label,
      "data-testid": testid,
    });
    this.view = new WorldView(this.canvas);
    this.view.followSize(callbacks.invalidate);
    this.frames = new FrameView(this.view, callbacks.invalidate);
    this.busy = el("div", { class: "busy", hidden: true }, "Simulating …");
    this.note = el("span", { class: "count number", "data-testid": `${testid}-count` });
    this.stage = el("div", { class: "stage" }, this.canvas, this.busy);
    this.bindPointer();
  }

  bindPointer() {
    const tip = new Tooltip(this.stage);
    bindGestures(this.canvas, this.view, {
      changed: () => this.callbacks.moved(),
      picked: this.callbacks.picked,
      fitted: () => this.fit(),
      hovered: (agent, x, y) => tip.show(agent === null ? null : this.describe(agent), x, y),
    });
  }

  /** Return the tooltip of an agent, or null. */
  describe(agent) {
    if (!this.shown) return this.life?.isStream ? `agent ${agent}` : null;
    return this.shown.recording.describeEater(this.shown.step + 1, agent);
  }

  zoom(factor) {
    this.view.zoomAt(factor);
    this.callbacks.moved();
  }

  /** Show the whole map. */
  fit() {
    this.view.setCamera(0.5, 0.5, 1);
    this.callbacks.moved();
  }

  /** Select an agent, or none. */
  select(agent) {
    this.agent = agent;
    this.callbacks.invalidate();
  }

  /**
   * Load a lifetime. The previous one stays visible until it is loaded.
   * @param {import("../core/sources.js").Source} source
   * @param {(changed: () => void, failed: (error: Error) => void) => any} open returns the lifetime;
   *   `changed` is called when a part of it is loaded
   */
  load(source, open) {
    this.loadingLife?.close();
    this.source = source;
    const start = performance.now();
    const life = open(
      () => {
        if (life === this.loadingLife && life.isLoaded) {
          // Milliseconds, for tests and benchmarks.
          this.stage.dataset.ready = String(Math.round(performance.now() - start));
          this.show(life);
        }
        this.callbacks.invalidate();
      },
      (error) => this.fail(error),
    );
    this.loadingLife = life;
    setTimeout(() => this.showBusy(), BUSY_DELAY);
  }

  /**
   * Show a lifetime.
   * @param {import("./recording.js").Life} life
   */
  show(life) {
    this.life?.close();
    this.life = life;
    this.loadingLife = null;
    this.showBusy();
    if (this.agent >= life.header.agents) this.agent = null;
    this.callbacks.loaded();
  }

  /** Remove the old lifetime, because the selectors name another one. */
  fail(error) {
    this.life?.close();
    this.life = this.loadingLife = this.shown = null;
    this.note.textContent = "";
    delete this.stage.dataset.ready;
    this.showBusy();
    this.callbacks.failed(error);
  }

  showBusy() {
    this.busy.hidden = !this.loadingLife;
  }

  /**
   * @param {number} time in steps
   * @param {{pace?: number, trails?: "off"|"recent"|"life", sight?: boolean}} [options] `pace` is in
   *   steps per second of playback
   * @returns {{isLoaded: boolean, ready: boolean}} whether the moment is loaded, and whether it is
   *   completely drawn
   */
  draw(time, { pace = 0, ...options } = {}) {
    const drawOptions = { ...options, selectedAgent: this.agent };
    if (!this.life?.isStream) return this.drawRecording(time, drawOptions);
    this.shown = null;
    const stream = /** @type {any} */ (this.life);
    const drawn = this.frames.draw(stream, time, { ...drawOptions, pace });
    setText(this.note, drawn.text);
    return drawn;
  }

  drawRecording(time, options) {
    const { life } = this;
    this.frames.legend.hide();
    // A second world can have a shorter lifetime.
    const recording = life?.findPart(Math.min(Math.floor(time), life.steps - 1)) ?? null;
    const moment = recording ? Math.min(Math.max(time, recording.first), recording.last - 1) : 0;
    const ready = this.view.draw(recording, moment, options);
    this.shown = recording && { recording, step: Math.floor(moment) };
    if (recording) setText(this.note, this.describeMoment(recording, Math.floor(moment)));
    return { isLoaded: recording !== null || !life, ready };
  }

  /** Return the text about a step. */
  describeMoment(recording, step) {
    return recording.describeEaten(step + 1);
  }

  close() {
    this.view.close();
    this.loadingLife?.close();
    // A lifetime that arrives later is ignored.
    this.loadingLife = null;
    this.life?.close();
  }
}
