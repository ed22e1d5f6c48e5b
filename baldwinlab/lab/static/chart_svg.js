/**
 * A chart of curves as an SVG file, with the same curves, bands, axes and legend as on the page.
 */

import { gridLine, textLabel, svgFile, svg, ticksBetween } from "./drawing.js";

// SVG units. PLOT is the height of the plot without margins.
const [WIDTH, PLOT] = [760, 340];
const [LEFT, RIGHT, TOP, BELOW] = [64, 20, 8, 52];
// The height of a legend row, and the approximate width of a letter.
const [ROW, LETTER] = [22, 6.8];

/** Return the range of the y axis. It includes 0. */
export function axisRange(low, high) {
  if (low == null) return [0, 1];
  return [Math.min(low, 0), high > Math.max(low, 0) ? high * 1.05 : Math.max(low, 0) + 1];
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
 */
export function curvesSvg({ title, x, names, series, xLabel = "", yLabel = "" }) {
  const scale = scaleOf(x, names, series);
  const keys = legend(series);
  const drawing = svg(
    "g",
    {},
    axes(scale, x, names, xLabel, yLabel),
    ...series.map((line) => band(scale, x, line)),
    ...series.flatMap((line) =>
      (line.runs ?? []).map(({ values }) =>
        curve(scale, x, values, {
          stroke: line.color,
          "stroke-width": 0.8,
          "stroke-opacity": 0.45,
        }),
      ),
    ),
    ...series.map((line) => mean(scale, x, line)),
    keys.drawing,
  );
  return svgFile(title, WIDTH, TOP + PLOT + BELOW + keys.height, drawing);
}

function scaleOf(x, names, series) {
  const all = series.flatMap(({ values, low, high, runs = [] }) =>
    [values, low, high, ...runs.map((run) => run.values)].filter(Boolean),
  );
  // Math.min(...values) fails for very many values.
  let [minimum, maximum] = [Infinity, -Infinity];
  for (const values of all)
    for (const value of values)
      if (value !== null) [minimum, maximum] = [Math.min(minimum, value), Math.max(maximum, value)];
  const [low, high] = axisRange(minimum > maximum ? null : minimum, maximum);
  const [first, last] = names
    ? [-0.5, names.length - 0.5]
    : x.length > 1
      ? [x[0], x[x.length - 1]]
      : [x[0] - 1, x[0] + 1];
  return {
    low,
    high,
    first,
    last,
    x: (at) => LEFT + ((at - first) / (last - first)) * (WIDTH - LEFT - RIGHT),
    y: (value) => TOP + (1 - (value - low) / (high - low)) * PLOT,
  };
}

function axes(scale, x, names, xLabel, yLabel) {
  const rows = ticksBetween(scale.low, scale.high).map((tick) => [
    gridLine(LEFT, scale.y(tick), WIDTH - RIGHT, scale.y(tick)),
    textLabel(String(tick), { x: LEFT - 8, y: scale.y(tick) + 4, "text-anchor": "end" }),
  ]);
  // Generations are whole numbers.
  const ticks = names ? Array.from(x) : ticksBetween(scale.first, scale.last, 1);
  const columns = ticks.map((tick) => [
    gridLine(scale.x(tick), TOP, scale.x(tick), TOP + PLOT),
    textLabel(names ? names[tick] : String(tick), {
      x: scale.x(tick),
      y: TOP + PLOT + 18,
      "text-anchor": "middle",
    }),
  ]);
  const [middle, height] = [LEFT + (WIDTH - LEFT - RIGHT) / 2, TOP + PLOT / 2];
  return svg(
    "g",
    {},
    ...rows.flat(),
    ...columns.flat(),
    textLabel(xLabel, { x: middle, y: TOP + PLOT + 38, "text-anchor": "middle" }),
    textLabel(yLabel, {
      transform: `translate(16 ${height}) rotate(-90)`,
      "text-anchor": "middle",
    }),
  );
}

/** Return the runs of consecutive indices at which all edges have a value. */
function definedStretches(x, ...edges) {
  const runs = [[]];
  for (let index = 0; index < x.length; index++) {
    if (edges.every((values) => values[index] !== null && values[index] !== undefined))
      runs.at(-1).push(index);
    else if (runs.at(-1).length) runs.push([]);
  }
  return runs.filter((stretch) => stretch.length);
}

function band(scale, x, { low, high, color }) {
  const point = (values) => (index) =>
    `${round(scale.x(x[index]))} ${round(scale.y(values[index]))}`;
  const areas = low && high ? definedStretches(x, low, high) : [];
  const outline = areas
    .map(
      (area) =>
        `M${area.map(point(high)).join("L")}L${area.toReversed().map(point(low)).join("L")}Z`,
    )
    .join("");
  return svg("path", { d: outline, fill: color, "fill-opacity": 0.18 });
}

function curve(scale, x, values, drawn) {
  const point = (index) => `${round(scale.x(x[index]))} ${round(scale.y(values[index]))}`;
  const lines = definedStretches(x, values).map((stretch) => `M${stretch.map(point).join("L")}`);
  return svg("path", { d: lines.join(""), fill: "none", "stroke-linejoin": "round", ...drawn });
}

/** Draw the curve of a mean. A curve with few values also has points. */
function mean(scale, x, { values, color, dash = [], label }) {
  const points = x.length > 12 ? [] : definedStretches(x, values).flat();
  return svg(
    "g",
    {},
    svg("title", {}, label),
    curve(scale, x, values, {
      stroke: color,
      "stroke-width": 2,
      "stroke-dasharray": dash.join(" "),
    }),
    ...points.map((index) =>
      svg("circle", {
        cx: round(scale.x(x[index])),
        cy: round(scale.y(values[index])),
        r: 3,
        fill: color,
      }),
    ),
  );
}

function legend(series) {
  let [left, row] = [LEFT, 0];
  const entries = series.map(({ label, color, dash = [] }) => {
    const width = 40 + LETTER * label.length;
    if (left > LEFT && left + width > WIDTH - RIGHT) [left, row] = [LEFT, row + 1];
    const [x, y] = [left, TOP + PLOT + BELOW + row * ROW + 8];
    left += width;
    return svg(
      "g",
      {},
      svg("line", {
        x1: x,
        x2: x + 22,
        y1: y,
        y2: y,
        stroke: color,
        "stroke-width": 3,
        "stroke-dasharray": dash.join(" "),
      }),
      textLabel(label, { x: x + 28, y: y + 4 }),
    );
  });
  return { drawing: svg("g", {}, ...entries), height: (row + 1) * ROW + 6 };
}

function round(index) {
  return Math.round(index * 100) / 100;
}
