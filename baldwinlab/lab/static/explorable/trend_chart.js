/** Curves over the generations: fixed axes, a label at each curve, and earlier runs as pale lines. */

import { formatColor } from "../core/palette.js";
import { el, formatNumber } from "../core/common.js";
import { chooseTicks, createSvg, drawGridRow, drawTextLabel } from "../core/drawing.js";

// The size of labels, as a share of the text of the page, and distances in sizes of a label.
const LABEL_SIZE = 0.78;
const MARGIN = { left: 3.4, top: 0.8, bottom: 2.8 };
// The mean width of a letter.
const LETTER_WIDTH = 0.62;
const LABEL_DISTANCE = 1.2;
const MAX_EARLIER_RUNS = 5;

export class TrendChart {
  /**
   * @param {HTMLElement} root
   * @param {object} options
   * @param {string} options.title
   * @param {string} options.xLabel
   * @param {number} options.xMax the last generation
   * @param {number} [options.yMin]
   * @param {number} options.yMax the axis grows only if a value is larger
   * @param {{name: string, label: string, color: string}[]} options.series
   */
  constructor(root, { title, xLabel, xMax, yMin = 0, yMax, series }) {
    this.title = title;
    this.xLabel = xLabel;
    this.xMax = xMax;
    this.yMin = yMin;
    this.yMax = yMax;
    this.series = series;
    this.svg = createSvg("svg", { role: "img", class: "trend" });
    root.append(el("div", { class: "chart-title" }, this.title), this.svg);
    // Lists of curves of earlier runs. A curve has its name, its color, and points [x, y].
    this.earlier = [];
    this.marks = [];
    this.reference = null;
    this.frame = 0;
    this.clear();
    this.observer = new ResizeObserver(() => this.draw());
    this.observer.observe(this.svg);
  }

  /** Remove the points of the current run. */
  clear() {
    const curves = this.series.map(({ name, color }) => ({ name, color, points: [] }));
    this.curves = new Map(curves.map((curve) => [curve.name, curve]));
    this.marks = [];
  }

  /** Start a new run. The current run becomes a pale line. */
  startRun() {
    const curves = [...this.curves.values()].filter(({ points }) => points.length > 1);
    if (curves.length) this.earlier.push(curves);
    this.earlier = this.earlier.slice(-MAX_EARLIER_RUNS);
    this.clear();
  }

  /** Add the next point of a curve. */
  add(name, y, x = this.curves.get(name).points.length) {
    this.curves.get(name).points.push([x, y]);
    while (y > this.yMax) this.yMax *= 2;
    this.frame ||= requestAnimationFrame(() => this.draw());
  }

  /** Return the newest value of a curve, or the mean of its last values. */
  read(name, count = 1) {
    const points = this.curves.get(name).points.slice(-count);
    return points.reduce((sum, [, y]) => sum + y, 0) / points.length;
  }

  /** Draw a vertical line with a text. */
  mark(x, text) {
    this.marks.push({ x, text });
  }

  draw() {
    cancelAnimationFrame(this.frame);
    this.frame = 0;
    // One unit is one pixel, so that texts keep their size.
    const { clientWidth: width, clientHeight: height } = this.svg;
    if (!width) return;
    this.size = LABEL_SIZE * Number.parseFloat(getComputedStyle(this.svg).fontSize);
    this.left = MARGIN.left * this.size;
    this.right = width - this.computeLabelWidth();
    // On paper, the picture gets the width of the page.
    this.svg.setAttribute("viewBox", `0 0 ${width} ${height}`);
    this.top = MARGIN.top * this.size;
    this.bottom = height - MARGIN.bottom * this.size;
    const pale = this.earlier.flat().map((curve) => this.drawCurve(curve, "earlier"));
    const curves = [...this.curves.values()].map((curve) => this.drawCurve(curve, "curve"));
    this.svg.replaceChildren(
      ...this.drawAxes(),
      ...pale,
      ...this.marks.flatMap((mark) => this.drawMark(mark)),
      ...this.drawReference(),
      ...curves,
      ...this.drawLabels(),
    );
    this.svg.setAttribute("aria-label", this.describe());
  }

  /** Return the space for the labels at the ends of the curves. */
  computeLabelWidth() {
    const labels = [...this.series.map(({ label }) => label), this.reference?.text ?? ""];
    return (1 + LETTER_WIDTH * Math.max(...labels.map(({ length }) => length))) * this.size;
  }

  placeX(x) {
    return this.left + (x / this.xMax) * (this.right - this.left);
  }

  placeY(y) {
    const share = (y - this.yMin) / (this.yMax - this.yMin);
    return this.bottom - share * (this.bottom - this.top);
  }

  drawAxes() {
    const rows = chooseTicks(this.yMin, this.yMax).filter((y) => y >= this.yMin && y <= this.yMax)
      .flatMap((y) => drawGridRow(formatNumber(y), this.left, this.right, this.placeY(y)));
    const step = chooseTicks(0, this.xMax)[1] * (this.right - this.left < 22 * this.size ? 2 : 1);
    const columns = Array.from(
      { length: Math.floor(this.xMax / step) + 1 },
      (_, tick) =>
        this.drawText(
          formatNumber(tick * step),
          this.placeX(tick * step),
          this.bottom + 1.2 * this.size,
        ),
    );
    const middle = (this.left + this.right) / 2;
    const label = this.drawText(this.xLabel, middle, this.bottom + 2.5 * this.size);
    const axis = [...rows, ...columns, label];
    for (const element of axis)
      if (element.tagName === "text") element.setAttribute("font-size", String(this.size));
    return axis;
  }

  drawText(text, x, y, anchor = "middle", attributes = {}) {
    return drawTextLabel(text, x, y, anchor, { "font-size": this.size, ...attributes });
  }

  drawCurve({ color, points }, kind) {
    const corners = points.map(([x, y]) => `${this.placeX(x)},${this.placeY(y)}`);
    return createSvg("polyline", {
      class: kind,
      points: corners.join(" "),
      stroke: formatColor(color),
    });
  }

  drawMark({ x, text }) {
    const line = { x1: this.placeX(x), x2: this.placeX(x), y1: this.top, y2: this.bottom };
    return [
      createSvg("line", { class: "switch", ...line }),
      this.drawText(text, this.placeX(x) - 0.4 * this.size, this.top + this.size, "end"),
    ];
  }

  /** Draw a dashed horizontal line with a text: `reference` has y, text and color. */
  drawReference() {
    if (!this.reference) return [];
    const { y, color } = this.reference;
    const line = { x1: this.left, x2: this.right, y1: this.placeY(y), y2: this.placeY(y) };
    return [createSvg("line", { class: "reference", ...line, stroke: formatColor(color) })];
  }

  /**
   * Draw the names of the curves at their ends, without overlaps. A curve that only an earlier run
   * has is labeled there.
   */
  drawLabels() {
    const drawn = [...this.earlier.flat(), ...this.curves.values()];
    const labels = this.series.flatMap(({ name, label, color }) => {
      const curve = drawn.findLast((other) => other.name === name && other.points.length);
      if (!curve) return [];
      const [x, y] = curve.points.at(-1);
      return [{ label, color, x: this.placeX(x), y: this.placeY(y) }];
    });
    if (this.reference) {
      const { text, y, color } = this.reference;
      labels.push({ label: text, color, x: this.right, y: this.placeY(y) });
    }
    labels.sort((first, second) => first.y - second.y);
    const distance = LABEL_DISTANCE * this.size;
    let y = -Infinity;
    for (const label of labels) y = label.y = Math.max(label.y, y + distance);
    // The lowest labels stay above the axis.
    y = this.bottom + distance;
    for (const label of labels.toReversed()) y = label.y = Math.min(label.y, y - distance);
    return labels.map(({ label, color, x, y: middle }) =>
      this.drawText(label, x + 0.5 * this.size, middle + 0.35 * this.size, "start", {
        fill: formatColor(color),
        opacity: 1,
        "font-weight": 600,
        class: "direct-label",
      })
    );
  }

  /** Return a text for screen readers: the newest values. */
  describe() {
    const values = this.series
      .filter(({ name }) => this.curves.get(name).points.length)
      .map(({ name, label }) => `${label} ${formatNumber(this.read(name))}`);
    return [this.title, ...values].join(", ");
  }
}
