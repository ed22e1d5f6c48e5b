/** The series of a chart: their styles, their columns in uPlot, their legend, and the switch of the runs. */

import { palette } from "../core/palette.js";
import { createButton, el } from "../core/common.js";
import { createSvg } from "../core/drawing.js";

const DASHES = [undefined, [8, 4], [8, 3, 2, 3], [2, 3]];

// With more curves, bands are paler, and a button hides all curves.
export const MAX_PLAIN_CURVES = 8;

/**
 * Return the color and dash of a condition, as in the figures of the report. The first 28 differ.
 */
export function selectSeriesStyle(number) {
  return {
    color: palette[`series-${number % 7}`],
    dash: DASHES[((number % 7) + Math.floor(number / 7)) % 4],
  };
}

/**
 * Return the columns of uPlot.
 *
 * The lines of runs come first, so they are drawn below. Each series has three columns: its mean,
 * and the edges of its band, which are empty without a band.
 */
export function collectColumns(x, series) {
  const empty = new Array(x.length).fill(null);
  return [
    x,
    ...collectRuns(series).map(({ values }) => values),
    ...series.flatMap((line) => [line.values, line.high ?? empty, line.low ?? empty]),
  ];
}

export function collectRuns(series) {
  return series.flatMap(({ label, runs = [] }, number) =>
    runs.map(({ run, values }) => ({ label, number, run, values }))
  );
}

/**
 * Return the lines of runs and the means with their columns. The first column is the line itself.
 */
export function collectCurves(series) {
  const runs = collectRuns(series).map((line, element) => ({ ...line, columns: [element + 1] }));
  return [
    ...runs,
    ...series.map(({ label, values }, number) => {
      const column = runs.length + 3 * number + 1;
      return { label, number, values, columns: [column, column + 1, column + 2] };
    }),
  ];
}

/**
 * Return a checkbox that shows each run as a thin line.
 * @param {(isChecked: boolean) => void} changed
 */
export function createRunSwitch(checked, changed) {
  const input = el("input", {
    type: "checkbox",
    checked,
    "data-testid": "each-run",
    onchange: () => changed(input.checked),
  });
  return el("label", { class: "inline" }, input, "show each run");
}

export function createLegendEntry(line, number, hidden, toggle) {
  const { color, dash } = { ...selectSeriesStyle(number), ...line };
  return createButton(
    [drawSwatch(color, dash), el("span", {}, line.label), el("span", { class: "chart-value" })],
    () => toggle(line.label),
    { class: "chart-key", "aria-pressed": String(!hidden.has(line.label)) },
  );
}

function drawSwatch(color, dash = []) {
  const line = {
    d: "M0 2H22",
    stroke: color,
    "stroke-width": 3,
    "stroke-dasharray": dash.map((length) => length * 0.8).join(" "),
  };
  return createSvg("svg", { width: 22, height: 4, "aria-hidden": "true" }, createSvg("path", line));
}
