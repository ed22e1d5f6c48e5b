/** Statistics of several runs. */

export function computeMean(values) {
  return values.reduce((sum, value) => sum + value, 0) / values.length;
}

/**
 * Return a quantile by linear interpolation, as NumPy computes it.
 * @param {number[]} values
 * @param {number} share from 0 to 1
 */
export function computeQuantile(values, share) {
  const sorted = [...values].sort((first, second) => first - second);
  const position = share * (sorted.length - 1);
  const below = Math.floor(position);
  const above = Math.min(below + 1, sorted.length - 1);
  return sorted[below] + (position - below) * (sorted[above] - sorted[below]);
}

/**
 * Return the series of an ensemble: the median with the middle 50 % of the runs, and the band of
 * the middle 90 %.
 * @param {string} label
 * @param {string} color
 * @param {(number[]|null)[]} runs the values of all runs in each generation; null: not finished
 * @returns {import("./charts.js").Series[]}
 */
export function createQuantileSeries(label, color, runs) {
  const quantile = (share) =>
    runs.map((values) => {
      const finite = values?.filter((value) => value !== null) ?? [];
      return finite.length ? computeQuantile(finite, share) : null;
    });
  return [
    {
      label: `${label}: median, 50 %`,
      color,
      values: quantile(0.5),
      low: quantile(0.25),
      high: quantile(0.75),
    },
    {
      label: `${label}: 90 %`,
      color,
      values: runs.map(() => null),
      low: quantile(0.05),
      high: quantile(0.95),
    },
  ];
}
