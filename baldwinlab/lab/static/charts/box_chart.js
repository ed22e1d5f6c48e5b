/** Box plots in SVG, with all values as points. A point can be a link that the keyboard reaches. */

import { el } from "../core/common.js";
import {
  chooseTicks,
  computeRange,
  createSvg,
  drawGridRow,
  drawTextLabel,
} from "../core/drawing.js";
import { computeQuantile } from "./quantiles.js";

// CSS pixels.
const TOP = 10;
const BOTTOM = 8;
const LEFT = 46;
// Half of the width of a box, relative to its slot.
const BOX_SHARE = 0.34;
// CSS pixels. Narrower slots have slanted labels, and wider slots do not have wider boxes.
const MIN_STRAIGHT_SLOT = 110;
const MAX_HALF_BOX = 36;

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
  const draw = () =>
    plot.replaceChildren(
      drawPlot(title, groups, Math.max(root.clientWidth, 160), options.height ?? 260),
    );
  draw();
  const sizeObserver = new ResizeObserver(draw);
  sizeObserver.observe(root);
  return { destroy: () => sizeObserver.disconnect() };
}

function drawPlot(title, groups, width, height) {
  const isSlanted = (width - LEFT) / groups.length < MIN_STRAIGHT_SLOT;
  const longest = Math.max(...groups.map((group) => group.label.length));
  // Approximate height of the labels.
  const bottom = BOTTOM + (isSlanted ? 14 + 4 * longest : 18);
  const ticks = chooseTicks(...computeRange(...groups.map((group) => group.values)));
  const [lowest, highest] = [ticks[0], ticks.at(-1)];
  const scale = (height - TOP - bottom) / (highest - lowest);
  const y = (value) => height - bottom - (value - lowest) * scale;
  const slot = (width - LEFT) / groups.length;
  const drawing = createSvg("svg", {
    width,
    height,
    viewBox: `0 0 ${width} ${height}`,
    role: "group",
    "aria-label": title,
  });
  for (const tick of ticks) drawing.append(...drawGridRow(String(tick), LEFT, width, y(tick)));
  groups.forEach((group, number) => {
    const middle = LEFT + slot * (number + 0.5);
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
