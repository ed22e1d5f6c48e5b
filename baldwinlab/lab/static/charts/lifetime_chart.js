/** A small chart over a lifetime with many thin lines and a time cursor. A click goes to a step. */

import { drawPicture } from "./chart_picture.js";
import { el, formatNumber, setText } from "../core/common.js";
import { formatColor, palette } from "../core/palette.js";
import { createChartDownloads } from "../core/downloads.js";

const MARGIN = { left: 40, right: 6, top: 6, bottom: 6 };

/**
 * @typedef {{x?: ArrayLike<number>|null, values: ArrayLike<number>, first?: number,
 *   stride?: number, offset?: number, color: string, alpha?: number}} Line
 */

export class LifetimeChart {
  /** @param {string} title @param {(step: number) => void} seek */
  constructor(title, seek, height = 84) {
    this.value = el("span", { class: "number" });
    this.canvas = el("canvas", { style: `height:${height}px`, role: "img", "aria-label": title });
    const saves = createChartDownloads(
      title.split(",")[0].replaceAll(" ", "-"),
      ["line", "step", "value"],
      () => this.listRows(),
      () => drawPicture(this.canvas, title),
    );
    this.root = el(
      "figure",
      { class: "trace" },
      el("figcaption", {}, el("h3", {}, title), this.value),
      this.canvas,
      saves,
    );
    this.canvas.addEventListener("click", (event) => {
      const share = (event.offsetX - MARGIN.left) /
        (this.canvas.clientWidth - MARGIN.left - MARGIN.right);
      seek(Math.round(Math.min(1, Math.max(0, share)) * this.steps));
    });
    this.layer = document.createElement("canvas");
    this.key = "";
    this.set([], 1, 0, 1);
  }

  /** @param {Line[]} lines over steps 0 to `steps`, between two values */
  set(lines, steps, low, high) {
    this.lines = lines;
    this.steps = steps;
    this.low = low;
    this.high = high > low ? high : low + 1;
    this.key = "";
  }

  /** Return one row per point. */
  listRows() {
    return this.lines.flatMap((line, number) =>
      listPoints(line).map(([step, value]) => ({ line: number, step, value }))
    );
  }

  draw(step, text) {
    const pixelRatio = Math.min(devicePixelRatio || 1, 2);
    const width = this.canvas.clientWidth;
    const height = this.canvas.clientHeight;
    if (!width) return;
    const key = `${width} ${height} ${pixelRatio} ${palette.map}`;
    if (key !== this.key) this.drawLines(width, height, pixelRatio);
    this.key = key;
    const pen = this.canvas.getContext("2d");
    pen.setTransform(1, 0, 0, 1, 0, 0);
    pen.clearRect(0, 0, this.canvas.width, this.canvas.height);
    pen.drawImage(this.layer, 0, 0);
    pen.fillStyle = palette.text;
    pen.globalAlpha = 0.65;
    pen.fillRect(
      Math.round(this.computeX(step, width) * pixelRatio),
      MARGIN.top * pixelRatio,
      Math.max(1, pixelRatio),
      (height - MARGIN.top - MARGIN.bottom) * pixelRatio,
    );
    pen.globalAlpha = 1;
    setText(this.value, text);
  }

  computeX(step, width) {
    return MARGIN.left + (step / this.steps) * (width - MARGIN.left - MARGIN.right);
  }

  drawLines(width, height, pixelRatio) {
    for (const canvas of [this.canvas, this.layer]) {
      canvas.width = width * pixelRatio;
      canvas.height = height * pixelRatio;
    }
    const pen = this.layer.getContext("2d");
    pen.setTransform(pixelRatio, 0, 0, pixelRatio, 0, 0);
    const yAt = (value) =>
      MARGIN.top +
      (1 - (value - this.low) / (this.high - this.low)) * (height - MARGIN.top - MARGIN.bottom);
    pen.font = `11px ${palette.font}`;
    pen.textAlign = "right";
    pen.textBaseline = "middle";
    const edges = this.low < 0 ? [this.low, 0, this.high] : [this.low, this.high];
    for (const value of edges) {
      pen.fillStyle = palette.soft;
      pen.fillText(
        formatNumber(Math.abs(value) >= 10 ? Math.round(value) : value),
        MARGIN.left - 5,
        yAt(value),
      );
      pen.fillStyle = palette.grid;
      pen.fillRect(MARGIN.left, yAt(value) - 0.5, width - MARGIN.left - MARGIN.right, 1);
    }
    for (const line of this.lines) this.drawLine(pen, line, width, yAt);
  }

  drawLine(pen, /** @type {Line} */ line, width, yAt) {
    const { x, values, first = 0, stride = 1, offset = 0, color, alpha = 1 } = line;
    const count = Math.floor((values.length - offset - 1) / stride) + 1;
    const interval = Math.max(1, Math.floor(count / (2 * width)));
    pen.strokeStyle = palette[color];
    pen.globalAlpha = alpha;
    pen.lineWidth = 1.2;
    pen.beginPath();
    for (let index = 0; index < count; index += interval)
      pen.lineTo(
        this.computeX(x ? x[index] : first + index, width),
        yAt(values[offset + index * stride]),
      );
    pen.stroke();
    pen.globalAlpha = 1;
  }
}

/** Return a line that explains colors. */
export function createColorKey(...colors) {
  const entries = colors.map(([color, text]) => [
    el("i", { style: `background: ${formatColor(color)}` }),
    text,
  ]);
  return el("p", { class: "soft hint" }, entries.flat());
}

/** Return the steps and values of a line. */
function listPoints(/** @type {Line} */ { x, values, first = 0, stride = 1, offset = 0 }) {
  const count = Math.floor((values.length - offset - 1) / stride) + 1;
  return Array.from({ length: count }, (_, index) => [
    x ? x[index] : first + index,
    values[offset + index * stride],
  ]);
}
