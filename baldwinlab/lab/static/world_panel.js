/** One world on the World tab: its selectors and its canvas. */

import { LifetimeSelector } from "./lifetime_selector.js";
import { el } from "./common.js";
import { FrameView } from "./frame_view.js";
import { bindGestures } from "./gestures.js";
import { createFreezerButton } from "./freezer_button.js";
import { openLifetime } from "./lifetimes.js";
import { formatAgent } from "./population.js";
import { Tooltip } from "./tooltip.js";
import { WorldView } from "./world.js";
import { createZoomButtons } from "./zoom_tools.js";

export class WorldPanel extends LifetimeSelector {
  /**
   * @param {string} name "a" or "b"
   * @param {object[]} studies the readable studies of /api/studies
   * @param {{invalidate: () => void, chosen: () => void, loaded: () => void, failed: (fault: Error)
   *   => void, picked: (agent: number|null) => void, moved: () => void, fitted: () => void,
   *   playAllClicked: () => void}} callbacks
   */
  constructor(name, studies, callbacks) {
    super(name, studies, callbacks);
    this.life = null;
    this.canvas = el("canvas", {
      tabindex: 0,
      role: "img",
      "data-testid": `world-${name}`,
      "aria-label": "The world",
    });
    this.busy = el("div", { class: "busy", hidden: true }, "Simulating …");
    this.note = el("div", { class: "count number", "data-testid": `eaten-${name}` });
    this.pickers.append(this.note);
    this.view = new WorldView(this.canvas);
    this.frames = new FrameView(this.view, callbacks.invalidate);
    const zoom = (factor) => {
      this.view.zoomAt(factor);
      callbacks.moved();
    };
    this.stage = el(
      "div",
      { class: "stage" },
      this.canvas,
      this.busy,
      el(
        "div",
        { class: "zoom-tools" },
        createZoomButtons({ zoom }),
        createFreezerButton(
          "Keep this population",
          `keep-${name}`,
          () => ({ source: this.source }),
        ),
      ),
    );
    this.root = el(
      "section",
      { class: "panel", "aria-label": name === "a" ? "World" : "Second world" },
      this.pickers,
      this.stage,
      this.frames.legend.root,
    );
    this.tip = new Tooltip(this.stage);
    const hovered = (agent, x, y) =>
      this.tip.show(agent === null || !this.describe ? null : this.describe(agent), x, y);
    bindGestures(this.canvas, this.view, {
      changed: callbacks.moved,
      picked: callbacks.picked,
      fitted: callbacks.fitted,
      hovered,
    });
    this.sized = new ResizeObserver(() => {
      this.view.resize();
      callbacks.invalidate();
    });
    this.sized.observe(this.stage);
  }

  /**
   * Show a lifetime. The previous one stays visible until it is loaded.
   * @param {import("./sources.js").Source} source
   */
  choose(source) {
    if (!this.setSource(source)) return;
    this.loadingLife?.close();
    const started = performance.now();
    this.loadingLife = openLifetime(
      source,
      this.condition ?? {},
      () => {
        if (this.loadingLife?.isLoaded) {
          this.life?.close();
          this.life = this.loadingLife;
          this.loadingLife = null;
          // Milliseconds, for tests and benchmarks.
          this.root.dataset.ready = String(Math.round(performance.now() - started));
          this.callbacks.loaded();
        }
        this.busy.hidden = !this.loadingLife;
        this.callbacks.invalidate();
      },
      (error) => {
        // Remove the old lifetime, because the selectors show another source.
        this.life?.close();
        this.life = this.loadingLife = null;
        this.note.textContent = "";
        delete this.root.dataset.ready;
        this.busy.hidden = true;
        this.callbacks.failed(error);
      },
    );
    setTimeout(() => (this.busy.hidden = !this.loadingLife), 150);
  }

  /**
   * @returns {{isLoaded: boolean, ready: boolean}} whether the moment is loaded, and whether it is
   *   completely drawn
   */
  draw(time, options) {
    if (this.life?.isStream) return this.drawStream(time, options);
    this.frames.legend.hide();
    const recording = this.life?.findPart(Math.floor(time)) ?? null;
    const moment = recording ? Math.min(time, recording.steps - 1) : 0;
    const ready = this.view.draw(recording, moment, options);
    this.curve.draw();
    if (recording) this.showCount(recording, Math.floor(moment));
    return { isLoaded: recording !== null || !this.life, ready };
  }

  drawStream(time, options) {
    const drawn = this.frames.draw(this.life, time, options);
    this.curve.draw();
    this.describe = (agent) => this.life.describeAgent(agent);
    if (this.note.textContent !== drawn.text) this.note.textContent = drawn.text;
    return drawn;
  }

  showCount(recording, step) {
    this.describe = (agent) => formatAgent(recording, agent, recording.countEaten(step + 1, agent));
    const learner = recording.header.learns ? "learns" : "cannot learn";
    const text = `${learner} · ${recording.describeEaten(step + 1)}`;
    if (this.note.textContent !== text) this.note.textContent = text;
  }

  close() {
    this.sized.disconnect();
    this.curve.close();
    this.life?.close();
    this.loadingLife?.close();
    this.root.remove();
  }
}
