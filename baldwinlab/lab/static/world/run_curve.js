/** The generation slider of a run, over a curve of its best and its average agent. */

import { ChartSlider } from "../charts/chart_slider.js";
import { createQuery, formatNumber, getJSON } from "../core/common.js";
import { computeRange } from "../core/drawing.js";
import { palette } from "../core/palette.js";
import { PRESETS } from "../core/sources.js";

/** @typedef {{measure: string, best: number[], mean: number[]}} Curve */

export class RunCurve extends ChartSlider {
  /**
   * @param {{go: (generation: number) => void, settled: () => void, invalidate: () => void}}
   *   callbacks `settled` is called after dragging
   */
  constructor({ go, settled, invalidate }) {
    super("run-curve plain", { "aria-label": "Generation" });
    this.invalidate = invalidate;
    this.isDragging = false;
    this.requested = null;
    this.curve = null;
    this.stop = null;
    this.slider.addEventListener("input", () => {
      // Intermediate generations are not history entries.
      this.isDragging = true;
      go(this.slider.valueAsNumber);
    });
    const endDrag = () => {
      if (!this.isDragging) return;
      this.isDragging = false;
      settled();
    };
    for (const end of ["change", "pointerup", "pointercancel"])
      this.slider.addEventListener(end, endDrag);
  }

  /**
   * Set the generation of a run. A run that is not stored has no curve.
   * @param {import("../core/sources.js").Source} source
   */
  async setSource({ study, condition, run, generation }, last) {
    this.setLast(last);
    this.show(generation);
    const requested = study === PRESETS ? null : String(createQuery({ study, condition, run }));
    if (requested === this.requested) return this.updateValueText();
    this.close();
    // The old curve stays visible until the new one is loaded.
    this.requested = requested;
    this.curve = null;
    try {
      this.setCurve(requested && (await getJSON(`api/run?${requested}`, this.stop.signal)));
    } catch (error) {
      // The request of the lifetime reports the error.
      if (error.name !== "AbortError") this.setCurve(null);
    }
  }

  /** @param {Curve|null} curve */
  setCurve(curve) {
    this.curve = curve;
    this.root.classList.toggle("plain", !curve);
    this.updateValueText();
    this.invalidate();
  }

  close() {
    this.stop?.abort();
    this.stop = new AbortController();
  }

  updateValueText() {
    if (this.curve)
      this.slider.setAttribute("aria-valuetext", this.describe(this.slider.valueAsNumber));
    else this.slider.removeAttribute("aria-valuetext");
  }

  describeAt(share) {
    const last = Number(this.slider.max);
    return this.curve && this.describe(Math.round(Math.min(1, Math.max(0, share)) * last));
  }

  describe(generation) {
    const { measure, best, mean } = this.curve;
    return (
      `generation ${formatNumber(generation)}, ${measure}: best ` +
      `${formatNumber(best[generation])}, average ${formatNumber(mean[generation])}`
    );
  }

  /** Draw the average agent as an area and the best agent as a line, if something has changed. */
  draw() {
    const sheet = this.curve && this.redrawIfChanged(this.curve);
    if (!sheet) return;
    const { pen, width, height, pixelRatio } = sheet;
    const { best, mean } = this.curve;
    const [low, high] = computeRange(best, mean);
    const x = (generation) => (best.length > 1 ? generation / (best.length - 1) : 0.5) * width;
    const y = (value) => (height - pixelRatio) * (high - value) / (high - low) + pixelRatio / 2;
    pen.fillStyle = palette.edge;
    pen.globalAlpha = 0.6;
    pen.fillRect(0, y(0) - pixelRatio / 2, width, pixelRatio);
    pen.fillStyle = pen.strokeStyle = palette.meal;
    pen.globalAlpha = 0.4;
    pen.beginPath();
    pen.moveTo(0, y(0));
    mean.forEach((value, generation) => pen.lineTo(x(generation), y(value)));
    pen.lineTo(width, y(0));
    pen.fill();
    pen.globalAlpha = 1;
    pen.lineWidth = 1.2 * pixelRatio;
    pen.lineJoin = "round";
    pen.beginPath();
    best.forEach((value, generation) => pen.lineTo(x(generation), y(value)));
    pen.stroke();
  }
}
