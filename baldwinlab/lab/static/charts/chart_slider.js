/** A slider on top of a small chart. The position of the slider is a position in the chart. */

import { el, Tooltip } from "../core/common.js";
import { palette } from "../core/palette.js";

// CSS pixels. The slider is half a thumb wider than its canvas at each end.
const THUMB_WIDTH = 16;

export class ChartSlider {
  /**
   * @param {string} kind a CSS class
   * @param {Object<string, any>} attributes of the slider
   */
  constructor(kind, attributes) {
    this.canvas = el("canvas", { "aria-hidden": "true" });
    this.slider = el("input", { type: "range", min: 0, step: 1, value: 0, ...attributes });
    this.root = el("div", { class: `chart-slider ${kind}` }, this.canvas, this.slider);
    this.tip = new Tooltip(this.root);
    const share = (event) =>
      (event.offsetX - THUMB_WIDTH / 2) / Math.max(1, this.canvas.clientWidth);
    this.slider.addEventListener(
      "pointermove",
      (event) =>
        event.pointerType === "mouse" &&
        this.tip.show(this.describeAt(share(event)), event.offsetX, 0),
    );
    this.slider.addEventListener("pointerleave", () => this.tip.show(null));
    this.key = [];
  }

  /**
   * Return the text for a position, as a share of the width. It can be below 0 or above 1.
   * @param {number} _share
   * @returns {string|null}
   */
  describeAt(_share) {
    return null;
  }

  setLast(last) {
    this.slider.max = last;
  }

  /** Move the slider. */
  show(value) {
    if (this.slider.valueAsNumber !== value) this.slider.value = value;
  }

  /**
   * Return the empty canvas in device pixels if its size, the colors or the data have
   * changed.
   */
  redrawIfChanged(...data) {
    const pixelRatio = Math.min(devicePixelRatio || 1, 2);
    const width = this.canvas.clientWidth * pixelRatio;
    const height = this.canvas.clientHeight * pixelRatio;
    const key = [width, height, palette.map, ...data];
    if (key.length === this.key.length && key.every((value, index) => value === this.key[index]))
      return null;
    this.key = key;
    this.canvas.width = Math.max(1, width);
    this.canvas.height = Math.max(1, height);
    return { pen: this.canvas.getContext("2d"), width, height, pixelRatio };
  }
}
