/** A slider that lies over a small chart, so that what is seen at a place is what the slider goes to. */

import { el } from "./common.js";
import { palette } from "./palette.js";
import { Tooltip } from "./tooltip.js";

const THUMB = 16; // CSS pixels; the slider is wider than its canvas by half of them at each end

export class ChartSlider {
  /** @param {string} kind a class of it @param {Object<string, any>} attributes of the slider */
  constructor(kind, attributes) {
    this.canvas = el("canvas", { "aria-hidden": "true" });
    this.slider = el("input", { type: "range", min: 0, step: 1, value: 0, ...attributes });
    this.root = el("div", { class: `chart-slider ${kind}` }, this.canvas, this.slider);
    this.tip = new Tooltip(this.root);
    const share = (event) => (event.offsetX - THUMB / 2) / Math.max(1, this.canvas.clientWidth);
    this.slider.addEventListener(
      "pointermove",
      (event) =>
        event.pointerType === "mouse" &&
        this.tip.show(this.describeAt(share(event)), event.offsetX, 0),
    );
    this.slider.addEventListener("pointerleave", () => this.tip.show(null));
    this.key = [];
  }

  /** What lies at a share of the canvas's width, in words; below 0 and above 1 in the halves of the thumb. @returns {string|null} */
  describeAt() {
    return null;
  }

  setLast(last) {
    this.slider.max = last;
  }

  /** Move the slider. */
  show(value) {
    if (this.slider.valueAsNumber !== value) this.slider.value = value;
  }

  /** The empty canvas in device pixels, where it must be drawn anew: its size, the colours or what it shows (`what`) have changed. */
  redrawIfChanged(...what) {
    const dots = Math.min(devicePixelRatio || 1, 2);
    const [width, height] = [this.canvas.clientWidth * dots, this.canvas.clientHeight * dots];
    const key = [width, height, palette.map, ...what];
    if (key.length === this.key.length && key.every((value, at) => value === this.key[at]))
      return null;
    this.key = key;
    this.canvas.width = Math.max(1, width);
    this.canvas.height = Math.max(1, height);
    return { pen: this.canvas.getContext("2d"), width, height, dots };
  }
}
