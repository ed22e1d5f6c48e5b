/** Curves over the generations: fixed axes, a label at each curve, and earlier runs as pale lines. */

import { formatColor } from "../core/palette.js";
import { el, formatNumber } from "../core/common.js";
import { chooseTicks, createSvg, drawGridRow, drawTextLabel } from "../core/drawing.js";
import { describeDifferences, placeBoxes } from "./run_labels.js";

// The size of labels, as a share of the text of the page, and distances in sizes of a label.
const LABEL_SIZE = 0.78;
// The minimum size of labels, in pixels.
const MIN_SIZE = 11;
const MARGIN = { left: 3.4, top: 0.8, bottom: 2.8 };
const LABEL_DISTANCE = 1.2;
const LABEL_WEIGHT = 600;
// The largest part of the width for the labels of earlier runs.
const MAX_LABEL_SHARE = 0.45;
const MAX_EARLIER_RUNS = 5;
// Measures texts.
const pen = document.createElement("canvas").getContext("2d");

export class TrendChart {
  /**
   * @param {HTMLElement} root
   * @param {object} options
   * @param {string} options.title
   * @param {string} options.xLabel
   * @param {number} options.xMax the last generation
   * @param {number} [options.yMin]
   * @param {number} options.yMax the axis grows only if a value is larger
   * @param {{name: string, label: string, color: string, isControl?: boolean}[]} options.series
   *   a control does not depend on the settings of a run
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
    // Earlier runs with their curves. A curve has its series, its color, and points [x, y].
    this.earlier = [];
    // The settings of the current run, see `RunSettings`.
    this.run = { settings: [], name: "" };
    this.marks = [];
    this.reference = null;
    this.frame = 0;
    this.clear();
    this.observer = new ResizeObserver(() => this.draw());
    this.observer.observe(this.svg);
  }

  /** Remove the points of the current run. */
  clear() {
    const curves = this.series.map((series) => ({ ...series, points: [] }));
    this.curves = new Map(curves.map((curve) => [curve.name, curve]));
    this.marks = [];
  }

  /** Start a new run. The current run becomes a pale line. The parameters are `RunSettings`. */
  startRun(settings, name = "") {
    const curves = [...this.curves.values()].filter(({ points }) => points.length > 1);
    if (curves.length) this.earlier.push({ ...this.run, curves });
    this.earlier = this.earlier.slice(-MAX_EARLIER_RUNS);
    this.run = { settings, name };
    this.clear();
  }

  /** The curves of all earlier runs. */
  get earlierCurves() {
    return this.earlier.flatMap(({ curves }) => curves);
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
    const { fontSize, fontFamily } = getComputedStyle(this.svg);
    this.size = Math.max(MIN_SIZE, LABEL_SIZE * Number.parseFloat(fontSize));
    this.font = `${LABEL_WEIGHT} ${this.size}px ${fontFamily}`;
    this.width = width;
    this.left = MARGIN.left * this.size;
    this.right = width - this.computeLabelWidth();
    // On paper, the picture gets the width of the page.
    this.svg.setAttribute("viewBox", `0 0 ${width} ${height}`);
    this.top = MARGIN.top * this.size;
    this.bottom = height - MARGIN.bottom * this.size;
    const pale = this.earlierCurves.map((curve) => this.drawCurve(curve, "earlier"));
    const curves = [...this.curves.values()].map((curve) => this.drawCurve(curve, "curve"));
    const labels = this.placeLabels();
    this.svg.replaceChildren(
      ...this.drawAxes(),
      ...pale,
      ...this.marks.flatMap((mark) => this.drawMark(mark)),
      ...this.drawReference(),
      ...curves,
      ...this.drawRunLabels(labels),
      ...labels.map((label) => this.drawLabel(label)),
    );
    this.svg.setAttribute("aria-label", this.describe());
  }

  /** Return the space for the labels at the ends of the curves. */
  computeLabelWidth() {
    const labels = [...this.series.map(({ label }) => label), this.reference?.text ?? ""];
    const differences = this.earlier.flatMap((run) => describeDifferences(run, this.run));
    return Math.max(
      this.measure(labels),
      Math.min(this.measure(differences), MAX_LABEL_SHARE * this.width),
    );
  }

  /** Return the width of texts below each other, with a margin. */
  measure(texts) {
    pen.font = this.font;
    return this.size + Math.max(...texts.map((text) => pen.measureText(text).width), 0);
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
   * Place the names of the curves at their ends, without overlaps. A curve that only an earlier run
   * has is labeled there.
   */
  placeLabels() {
    const drawn = [...this.earlierCurves, ...this.curves.values()];
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
    const distance = this.lineHeight;
    let y = -Infinity;
    for (const label of labels) y = label.y = Math.max(label.y, y + distance);
    // The lowest labels stay above the axis.
    y = this.bottom + distance;
    for (const label of labels.toReversed()) y = label.y = Math.min(label.y, y - distance);
    return labels;
  }

  get lineHeight() {
    return LABEL_DISTANCE * this.size;
  }

  drawLabel({ label, color, x, y }) {
    return this.drawText(label, x + 0.5 * this.size, y + 0.35 * this.size, "start", {
      fill: formatColor(color),
      opacity: 1,
      "font-weight": LABEL_WEIGHT,
      class: "direct-label",
    });
  }

  /** Draw at the ends of pale lines how their runs differ. Labels without space are omitted. */
  drawRunLabels(labels) {
    const obstacles = labels.map(({ label, x, y }) => this.createBox([label], x, y));
    const mark = ({ x, text }) =>
      this.createBox([text], this.placeX(x) - this.measure([text]), this.top + this.size);
    obstacles.push(...this.marks.map(mark));
    // The newest runs choose their places first.
    const boxes = this.earlier.toReversed().flatMap((run) => {
      const lines = describeDifferences(run, this.run);
      const curves = lines.length ? run.curves.filter(({ isControl }) => !isControl) : [];
      return curves.map(({ points, color }) => {
        const [x, y] = points.at(-1);
        const end = { x: this.placeX(x), y: this.placeY(y) };
        return { ...this.createBox(lines, end.x, end.y), lines, color, end };
      });
    });
    const limits = { top: 0, bottom: this.bottom + 0.5 * this.lineHeight };
    return placeBoxes(boxes, obstacles, limits, this.lineHeight)
      .flatMap((box) => this.drawRunLabel(box));
  }

  /** Return the box of a label at a point. A box has the height of its lines. */
  createBox(lines, x, y) {
    const width = this.measure(lines);
    const left = Math.min(x, this.width - width);
    const height = lines.length * this.lineHeight;
    return { left, right: left + width, top: y - height / 2, bottom: y + height / 2 };
  }

  /** Draw a label, and a line to the end of its curve if the label is not next to it. */
  drawRunLabel({ lines, color, end, left, top, bottom }) {
    const fill = formatColor(color);
    const attributes = { fill, opacity: 1, class: "run-label" };
    const x = left + 0.5 * this.size;
    const texts = lines.map((text, line) => {
      const y = top + (line + 0.5) * this.lineHeight + 0.35 * this.size;
      return this.drawText(text, x, y, "start", attributes);
    });
    const middle = (top + bottom) / 2;
    if (Math.abs(middle - end.y) < 1) return texts;
    const line = { x1: end.x, y1: end.y, x2: x - 2, y2: middle, stroke: fill };
    return [createSvg("line", { class: "leader", ...line }), ...texts];
  }

  /** Return a text for screen readers: the newest values, and the last ones of earlier runs. */
  describe() {
    const current = this.describeCurves([...this.curves.values()]);
    const earlier = this.earlier.flatMap((run) => {
      const lines = describeDifferences(run, this.run);
      return lines.length ? [`${lines.join(", ")}: ${this.describeCurves(run.curves)}`] : [];
    });
    return [`${this.title}: ${current}`, ...earlier].join(". ");
  }

  describeCurves(curves) {
    return curves
      .filter(({ points }) => points.length)
      .map(({ label, points }) => `${label} ${formatNumber(points.at(-1)[1])}`)
      .join(", ");
  }
}
