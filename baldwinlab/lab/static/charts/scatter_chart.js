/** A scatter plot in SVG with the line of equal values. Its points can be pressed. */

import { el } from "../core/common.js";
import { bindButtons } from "../core/svg_buttons.js";
import {
  chooseTicks,
  computeRange,
  createSvg,
  drawGridLine,
  drawGridRow,
  drawTextLabel,
} from "../core/drawing.js";

// SVG units.
const SIZE = 420;
const LEFT = 54;
const BOTTOM = 46;
const MARGIN = 12;
const RADIUS = 6;

/**
 * @typedef {object} Point
 * @property {number} x
 * @property {number} y
 * @property {string} label for tooltips and screen readers
 * @property {number} shade from 0 to 1
 */

/**
 * Return a plot of points that includes 0, with the same scale on both axes.
 * @param {{title: string, xLabel: string, yLabel: string, points: Point[], color: string}} options
 * @param {(index: number) => void} pick called for a click, or Enter on a point
 */
export function createScatterChart(options, pick) {
  const drawing = drawPlot(options);
  const dots = [...drawing.querySelectorAll("circle")];
  bindButtons(
    dots,
    options.points.map(({ label }) => label),
    pick,
  );
  return el("div", { class: "scatter" }, drawing);
}

function drawPlot({ title, xLabel, yLabel, points, color }) {
  const ticks = chooseTicks(...computeRange(points.flatMap(({ x, y }) => [x, y])));
  const [start, end] = [ticks[0], ticks.at(-1)];
  const length = SIZE - LEFT - MARGIN;
  const computeShare = (value) => (value - start) / (end - start);
  const toX = (value) => LEFT + computeShare(value) * length;
  const toY = (value) => SIZE - BOTTOM - computeShare(value) * (SIZE - BOTTOM - MARGIN);
  const svg = createSvg("svg", {
    viewBox: `0 0 ${SIZE} ${SIZE}`,
    role: "group",
    "aria-label": title,
  });
  for (const tick of ticks)
    svg.append(
      ...drawGridRow(String(tick), LEFT, SIZE - MARGIN, toY(tick)),
      drawGridLine(toX(tick), MARGIN, toX(tick), SIZE - BOTTOM),
      drawTextLabel(String(tick), toX(tick), SIZE - BOTTOM + 18, "middle"),
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
    drawTextLabel(xLabel, LEFT + length / 2, SIZE - 6, "middle"),
    drawTextLabel(yLabel, 12, SIZE / 2, "middle", { transform: `rotate(-90 12 ${SIZE / 2})` }),
    ...points.map(({ x, y, label, shade }) =>
      createSvg(
        "circle",
        {
          cx: toX(x),
          cy: toY(y),
          r: RADIUS,
          fill: color,
          "fill-opacity": 0.25 + 0.65 * shade,
          stroke: color,
        },
        createSvg("title", {}, label),
      )
    ),
  );
  return svg;
}
