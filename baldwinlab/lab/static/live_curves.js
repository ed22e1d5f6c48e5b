/** The curves of a live run. */

import { selectSeriesStyle } from "./chart_series.js";
import { createLineChart } from "./charts.js";
import { el } from "./common.js";
import { createChartDownloads } from "./downloads.js";

/** Draw fitness and the share of agents that eat. A click on a curve shows that generation. */
export function createCurves(feed, fitness, share, runSwitch, pick) {
  const {
    runs,
    experiment: { world },
  } = feed.summary;
  const x = Array.from(
    { length: feed.summary.experiment.evolution.generations },
    (_, generation) => generation,
  );
  // The axis covers all generations from the start.
  const padded = (values) => values && x.map((generation) => values[generation] ?? null);
  const band = (label, name, number) => {
    const { mean, low, high, runs: runValues } = feed.bands[name];
    const runLines = Array.from({ length: runSwitch.checked ? runs : 0 }, (_, run) => ({
      run,
      values: padded((runValues ?? []).map((values) => values[run])),
    }));
    return {
      label,
      color: selectSeriesStyle(number).color,
      values: padded(mean),
      low: padded(low),
      high: padded(high),
      runs: runLines,
    };
  };
  const lines = () => [band("best agent", "best", 0), band("average agent", "mean", 1)];
  const shares = () => [band(world ? "share of agents that eat" : "share above 0", "share", 2)];
  const options = { x, xLabel: "generation", height: 210, onPick: ({ x, run }) => pick(x, run) };
  const suffix = runs > 1 ? `, mean of ${runs} runs with 95 % interval` : "";
  const chart = (root, name, more, shown) => {
    const plot = el("div");
    const chart = createLineChart(plot, { ...options, ...more, series: shown() });
    const rows = () =>
      shown().flatMap(({ label, values, low, high }) =>
        x.slice(0, feed.generationsDone).map((generation) => ({
          curve: label,
          generation,
          mean: values[generation],
          low: low?.[generation],
          high: high?.[generation],
        })),
      );
    root.append(
      plot,
      createChartDownloads(name, ["curve", "generation", "mean", "low", "high"], rows, chart.svg),
    );
    return chart;
  };
  const charts = [
    chart(
      fitness,
      "fitness",
      { title: `Fitness${suffix}`, yLabel: world ? "fitness (energy)" : "fitness" },
      lines,
    ),
    chart(
      share,
      "share",
      {
        title: world ? "Share of agents that eat" : "Share of agents with fitness above 0",
        yLabel: "share",
        height: 150,
      },
      shares,
    ),
  ];
  let drawn = 0;
  const draw = () => {
    drawn = 0;
    charts[0].update(x, lines());
    charts[1].update(x, shares());
  };
  return {
    // Draw once per frame, independent of the number of messages.
    update: () => (drawn ||= requestAnimationFrame(draw)),
    close() {
      cancelAnimationFrame(drawn);
      for (const chart of charts) chart.destroy();
    },
  };
}
