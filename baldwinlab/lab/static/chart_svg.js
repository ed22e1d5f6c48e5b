/**
 * A chart of curves as an SVG file, with the same curves, bands, axes and legend as on the page.
 */

import {
  chooseTicksBetween,
  computeRange,
  createSvg,
  drawGridLine,
  drawTextLabel,
  formatSvgFile,
} from "./drawing.js";

// SVG units. PLOT_HEIGHT is without margins.
const WIDTH = 760;
const PLOT_HEIGHT = 340;
const LEFT = 64;
const RIGHT = 20;
const TOP = 8;
const BOTTOM = 52;
// The height of a legend row, and the approximate width of a letter.
const LEGEND_ROW = 22;
const LETTER_WIDTH = 6.8;

// Space between the curves and the ends of the y axis other than 0.
const AXIS_MARGIN = 1.05;

/** Return the range of the y axis for numbers. It includes 0. */
export function computeAxisRange(...lists) {
  const [low, high] = computeRange(...lists);
  return [low * AXIS_MARGIN, high * AXIS_MARGIN];
}

/**
 * Return the text of an SVG file.
 * @param {object} chart
 * @param {string} chart.title
 * @param {ArrayLike<number>} chart.x in ascending order
 * @param {string[]} [chart.names] of the positions on the x axis, instead of numbers
 * @param {(import("./charts.js").Series & {color: string, dash?: number[]})[]} chart.series the
 *   visible series
 * @param {string} [chart.xLabel]
 * @param {string} [chart.yLabel]
 * @param {string} [chart.note] below the legend
 */
export function drawCurvesFile({ title, x, names, series, xLabel = "", yLabel = "", note = "" }) {
  const scale = computeScale(x, names, series);
  const keys = drawLegend(series);
  const drawing = createSvg(
    "g",
    {},
    drawAxes(scale, x, names, xLabel, yLabel),
    ...series.map((line) => drawBand(scale, x, line)),
    ...series.flatMap((line) =>
      (line.runs ?? []).map(({ values }) =>
        drawCurve(scale, x, values, {
          stroke: line.color,
          "stroke-width": 0.8,
          "stroke-opacity": 0.45,
        })
      )
    ),
    ...series.map((line) => drawMean(scale, x, line)),
    keys.drawing,
    drawTextLabel(note, { x: LEFT, y: TOP + PLOT_HEIGHT + BOTTOM + keys.height + 6 }),
  );
  const noteHeight = note ? LEGEND_ROW : 0;
  const height = TOP + PLOT_HEIGHT + BOTTOM + keys.height + noteHeight;
  return formatSvgFile(title, WIDTH, height, drawing);
}

function computeScale(x, names, series) {
  const all = series.flatMap(({ values, low, high, runs = [] }) =>
    [values, low, high, ...runs.map((run) => run.values)].filter(Boolean)
  );
  const [low, high] = computeAxisRange(...all);
  const [first, last] = computeDomain(x, names);
  return {
    low,
    high,
    first,
    last,
    x: (index) => LEFT + ((index - first) / (last - first)) * (WIDTH - LEFT - RIGHT),
    y: (value) => TOP + (1 - (value - low) / (high - low)) * PLOT_HEIGHT,
  };
}

/** Return the first and the last position of the x axis. */
function computeDomain(x, names) {
  if (names) return [-0.5, names.length - 0.5];
  return x.length > 1 ? [x[0], x[x.length - 1]] : [x[0] - 1, x[0] + 1];
}

function drawAxes(scale, x, names, xLabel, yLabel) {
  const rows = chooseTicksBetween(scale.low, scale.high).map((tick) => [
    drawGridLine(LEFT, scale.y(tick), WIDTH - RIGHT, scale.y(tick)),
    drawTextLabel(String(tick), { x: LEFT - 8, y: scale.y(tick) + 4, "text-anchor": "end" }),
  ]);
  // Generations are whole numbers.
  const ticks = names ? Array.from(x) : chooseTicksBetween(scale.first, scale.last, 1);
  const columns = ticks.map((tick) => [
    drawGridLine(scale.x(tick), TOP, scale.x(tick), TOP + PLOT_HEIGHT),
    drawTextLabel(names ? names[tick] : String(tick), {
      x: scale.x(tick),
      y: TOP + PLOT_HEIGHT + 18,
      "text-anchor": "middle",
    }),
  ]);
  const middle = LEFT + (WIDTH - LEFT - RIGHT) / 2;
  const height = TOP + PLOT_HEIGHT / 2;
  return createSvg(
    "g",
    {},
    ...rows.flat(),
    ...columns.flat(),
    drawTextLabel(xLabel, { x: middle, y: TOP + PLOT_HEIGHT + 38, "text-anchor": "middle" }),
    drawTextLabel(yLabel, {
      transform: `translate(16 ${height}) rotate(-90)`,
      "text-anchor": "middle",
    }),
  );
}

/** Return the ranges of consecutive indices at which all edges have a value. */
function findDefinedRanges(x, ...edges) {
  const ranges = [[]];
  for (let index = 0; index < x.length; index++) {
    if (edges.every((values) => values[index] !== null && values[index] !== undefined))
      ranges.at(-1).push(index);
    else if (ranges.at(-1).length) ranges.push([]);
  }
  return ranges.filter((range) => range.length);
}

function drawBand(scale, x, /** @type {import("./charts.js").Series} */ { low, high, color }) {
  const point = (values) => (index) =>
    `${round(scale.x(x[index]))} ${round(scale.y(values[index]))}`;
  const areas = low && high ? findDefinedRanges(x, low, high) : [];
  const outline = areas
    .map(
      (area) =>
        `M${area.map(point(high)).join("L")}L${area.toReversed().map(point(low)).join("L")}Z`,
    )
    .join("");
  return createSvg("path", { d: outline, fill: color, "fill-opacity": 0.18 });
}

function drawCurve(scale, x, values, attributes) {
  const point = (index) => `${round(scale.x(x[index]))} ${round(scale.y(values[index]))}`;
  const lines = findDefinedRanges(x, values).map((range) => `M${range.map(point).join("L")}`);
  return createSvg("path", {
    d: lines.join(""),
    fill: "none",
    "stroke-linejoin": "round",
    ...attributes,
  });
}

/** Draw the curve of a mean. A curve with few values also has points. */
function drawMean(scale, x, { values, color, dash = [], label }) {
  const points = x.length > 12 ? [] : findDefinedRanges(x, values).flat();
  return createSvg(
    "g",
    {},
    createSvg("title", {}, label),
    drawCurve(scale, x, values, {
      stroke: color,
      "stroke-width": 2,
      "stroke-dasharray": dash.join(" "),
    }),
    ...points.map((index) =>
      createSvg("circle", {
        cx: round(scale.x(x[index])),
        cy: round(scale.y(values[index])),
        r: 3,
        fill: color,
      })
    ),
  );
}

function drawLegend(series) {
  let left = LEFT;
  let row = 0;
  const entries = series.map(({ label, color, dash = [] }) => {
    const width = 40 + LETTER_WIDTH * label.length;
    if (left > LEFT && left + width > WIDTH - RIGHT) {
      left = LEFT;
      row += 1;
    }
    const x = left;
    const y = TOP + PLOT_HEIGHT + BOTTOM + row * LEGEND_ROW + 8;
    left += width;
    return createSvg(
      "g",
      {},
      createSvg("line", {
        x1: x,
        x2: x + 22,
        y1: y,
        y2: y,
        stroke: color,
        "stroke-width": 3,
        "stroke-dasharray": dash.join(" "),
      }),
      drawTextLabel(label, { x: x + 28, y: y + 4 }),
    );
  });
  return { drawing: createSvg("g", {}, ...entries), height: (row + 1) * LEGEND_ROW + 6 };
}

function round(number) {
  return Math.round(number * 100) / 100;
}
