/** The series of a chart: their styles, and their columns in uPlot. */

import { palette } from "../core/palette.js";

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
