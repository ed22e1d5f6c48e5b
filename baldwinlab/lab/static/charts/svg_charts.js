/** Box plots and scatter plots in SVG. The keyboard reaches their points. */

import { el } from "../core/common.js";
import {
  bindButtons,
  chooseTicks,
  computeRange,
  createSvg,
  drawGridLine,
  drawGridRow,
  drawTextLabel,
} from "../core/drawing.js";
import { computeQuantile } from "./quantiles.js";

// Margins of a box plot, in CSS pixels.
const BOX_MARGIN = { top: 10, bottom: 8, left: 46 };
// Half of the width of a box, relative to its slot.
const BOX_SHARE = 0.34;
// CSS pixels. Narrower slots have slanted labels, and wider slots do not have wider boxes.
const MIN_STRAIGHT_SLOT = 110;
const MAX_HALF_BOX = 36;
// Side, margins and radius of points of a scatter plot, in SVG units.
const SCATTER_SIZE = 420;
const SCATTER_MARGIN = { left: 54, bottom: 46, other: 12 };
const SCATTER_RADIUS = 6;

/**
 * @typedef {object} Group
 * @property {string} label
 * @property {(number|null)[]} values one per run
 * @property {string} color
 * @property {(index: number) => string} [describe] the text of a point, for tooltips and screen
 *   readers
 * @property {(index: number) => string} [href] the target of a point
 * @property {string} [targetText] the description of the target
 */

/**
 * Draw a box and all values of each group.
 *
 * The box shows the median and the quartiles, and the whiskers end at the farthest value within 1.5
 * times the height of the box.
 * @param {HTMLElement} root is emptied and filled; the chart follows its width
 * @param {{title: string, groups: Group[], height?: number}} options
 * @returns {{destroy: () => void}}
 */
export function drawBoxChart(root, options) {
  const { title, groups } = options;
  const plot = el("div", { class: "chart-plot" });
  root.replaceChildren(el("div", { class: "chart-title" }, title), plot);
  let width = null;
  const draw = () => {
    if (root.clientWidth === width) return;
    width = root.clientWidth;
    // A new drawing would take the focus away from a point.
    const focused = [...plot.querySelectorAll("a")]
      .findIndex((point) => point === document.activeElement);
    plot.replaceChildren(
      drawBoxPlot(title, groups, Math.max(width, 160), options.height ?? 260),
    );
    plot.querySelectorAll("a")[focused]?.focus();
  };
  draw();
  const sizeObserver = new ResizeObserver(draw);
  sizeObserver.observe(root);
  return { destroy: () => sizeObserver.disconnect() };
}

function drawBoxPlot(title, groups, width, height) {
  const isSlanted = (width - BOX_MARGIN.left) / groups.length < MIN_STRAIGHT_SLOT;
  const longest = Math.max(...groups.map((group) => group.label.length));
  // Approximate height of the labels.
  const bottom = BOX_MARGIN.bottom + (isSlanted ? 14 + 4 * longest : 18);
  const ticks = chooseTicks(...computeRange(...groups.map((group) => group.values)));
  const [lowest, highest] = [ticks[0], ticks.at(-1)];
  const scale = (height - BOX_MARGIN.top - bottom) / (highest - lowest);
  const y = (value) => height - bottom - (value - lowest) * scale;
  const slot = (width - BOX_MARGIN.left) / groups.length;
  const drawing = createPlot(title, width, height, { width, height });
  for (const tick of ticks)
    drawing.append(...drawGridRow(String(tick), BOX_MARGIN.left, width, y(tick)));
  groups.forEach((group, number) => {
    const middle = BOX_MARGIN.left + slot * (number + 0.5);
    drawing.append(drawLabel(group.label, middle, height - bottom + 16, isSlanted));
    if (group.values.some(Number.isFinite))
      drawing.append(drawBox(group, middle, slot, y), ...drawPoints(group, middle, slot, y));
  });
  return drawing;
}

function drawBox(group, middle, slot, y) {
  const finite = group.values.filter(Number.isFinite);
  const { low, first, median, third, high } = computeBoxStatistics(finite);
  const half = Math.min(slot * BOX_SHARE, MAX_HALF_BOX);
  const line = (x1, y1, x2, y2, width = 1.5) =>
    createSvg("line", { x1, y1, x2, y2, stroke: group.color, "stroke-width": width });
  return createSvg(
    "g",
    { "aria-hidden": "true" },
    createSvg("rect", {
      x: middle - half,
      width: 2 * half,
      y: y(third),
      height: Math.max(y(first) - y(third), 0.5),
      fill: group.color,
      "fill-opacity": 0.12,
      stroke: group.color,
      "stroke-width": 1.5,
      rx: 2,
    }),
    line(middle, y(third), middle, y(high)),
    line(middle, y(first), middle, y(low)),
    line(middle - half, y(median), middle + half, y(median), 3),
  );
}

function drawPoints(group, middle, slot, y) {
  const half = Math.min(slot * BOX_SHARE, MAX_HALF_BOX) * 0.8;
  return group.values.flatMap((value, index) => {
    // The final value of a species without agents is missing.
    if (!Number.isFinite(value)) return [];
    // Deterministic, evenly spread positions.
    const x = middle + half * (2 * ((index * 0.618034) % 1) - 1);
    const described = group.describe?.(index) ?? String(value);
    const name = group.href ? `${described}. ${group.targetText}` : described;
    const dot = createSvg(
      "circle",
      { cx: x, cy: y(value), r: 4, fill: group.color, "fill-opacity": 0.75 },
      createSvg("title", {}, name),
    );
    return group.href
      ? createSvg("a", { href: group.href(index), "aria-label": name, class: "chart-point" }, dot)
      : dot;
  });
}

function drawLabel(text, x, y, isSlanted) {
  return isSlanted
    ? drawTextLabel(text, 0, 0, "end", { transform: `translate(${x} ${y - 4}) rotate(-38)` })
    : drawTextLabel(text, x, y, "middle");
}

/** Return the median, the quartiles and the farthest values within 1.5 times their distance. */
export function computeBoxStatistics(values) {
  const [first, median, third] = [0.25, 0.5, 0.75].map((share) => computeQuantile(values, share));
  const whiskerLength = 1.5 * (third - first);
  const inliers = values.filter(
    (value) => value >= first - whiskerLength && value <= third + whiskerLength,
  );
  return { low: Math.min(...inliers), first, median, third, high: Math.max(...inliers) };
}

/**
 * @typedef {object} Point
 * @property {number} x
 * @property {number} y
 * @property {string} label for tooltips and screen readers
 * @property {number} shade from 0 to 1
 * @property {string} name next to the point, or ""
 */

/**
 * Return a plot of points that includes 0, with the same scale on both axes.
 * @param {{title: string, xLabel: string, yLabel: string, points: Point[], color: string}} options
 * @param {(index: number) => void} pick called for a click, or Enter on a point
 */
export function createScatterChart(options, pick) {
  const drawing = drawScatterPlot(options);
  const dots = [...drawing.querySelectorAll("circle")];
  bindButtons(
    dots,
    options.points.map(({ label }) => label),
    pick,
  );
  return el("div", { class: "scatter" }, drawing);
}

function drawScatterPlot({ title, xLabel, yLabel, points, color }) {
  const ticks = chooseTicks(...computeRange(points.flatMap(({ x, y }) => [x, y])));
  const [start, end] = [ticks[0], ticks.at(-1)];
  const length = SCATTER_SIZE - SCATTER_MARGIN.left - SCATTER_MARGIN.other;
  const computeShare = (value) => (value - start) / (end - start);
  const toX = (value) => SCATTER_MARGIN.left + computeShare(value) * length;
  const toY = (value) =>
    SCATTER_SIZE - SCATTER_MARGIN.bottom -
    computeShare(value) * (SCATTER_SIZE - SCATTER_MARGIN.bottom - SCATTER_MARGIN.other);
  const svg = createPlot(title, SCATTER_SIZE, SCATTER_SIZE);
  for (const tick of ticks)
    svg.append(
      ...drawGridRow(
        String(tick),
        SCATTER_MARGIN.left,
        SCATTER_SIZE - SCATTER_MARGIN.other,
        toY(tick),
      ),
      drawGridLine(
        toX(tick),
        SCATTER_MARGIN.other,
        toX(tick),
        SCATTER_SIZE - SCATTER_MARGIN.bottom,
      ),
      drawTextLabel(String(tick), toX(tick), SCATTER_SIZE - SCATTER_MARGIN.bottom + 18, "middle"),
    );
  svg.append(
    createSvg("line", {
      x1: toX(start),
      y1: toY(start),
      x2: toX(end),
      y2: toY(end),
      stroke: "currentColor",
      "stroke-dasharray": "5 5",
    }),
    drawTextLabel(xLabel, SCATTER_MARGIN.left + length / 2, SCATTER_SIZE - 6, "middle"),
    drawTextLabel(yLabel, 12, SCATTER_SIZE / 2, "middle", {
      transform: `rotate(-90 12 ${SCATTER_SIZE / 2})`,
    }),
    ...points.map(({ x, y, label, shade }) =>
      createSvg(
        "circle",
        {
          cx: toX(x),
          cy: toY(y),
          r: SCATTER_RADIUS,
          fill: color,
          "fill-opacity": 0.25 + 0.65 * shade,
          stroke: color,
        },
        createSvg("title", {}, label),
      )
    ),
    ...points.filter(({ name }) => name).map(({ x, y, name }) => {
      const isRight = computeShare(x) > 0.5;
      const distance = SCATTER_RADIUS + 4;
      const left = toX(x) + (isRight ? -distance : distance);
      return drawTextLabel(name, left, toY(y) + 4, isRight ? "end" : "start", { class: "name" });
    }),
  );
  return svg;
}

/** Return an empty drawing of this size. Without attributes, it has the width of its element. */
function createPlot(title, width, height, attributes = {}) {
  const viewBox = `0 0 ${width} ${height}`;
  return createSvg("svg", { viewBox, role: "group", "aria-label": title, ...attributes });
}
