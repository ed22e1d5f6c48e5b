/** The curves of a study, generation by generation. */

import { selectSeriesStyle } from "./chart_series.js";
import { createLineChart } from "./charts.js";
import { el, showMessage } from "./common.js";
import { createChartDownloads, createDownloadButton, formatCsv } from "./downloads.js";
import { combineCurves } from "./results_factors.js";
import { describeMeasures, hasWorldView } from "./results_measures.js";
import { formatLifetimeAddress } from "./sources.js";

export function explainCurves(view) {
  if (!view.hasSingleConditions)
    return (
      `Each curve is the mean of the conditions with one value of ${view.by}. Its ` +
      "band goes from the lowest to the highest condition. Click a curve to see its " +
      "conditions."
    );
  const bands = "The bands are 95 % confidence intervals over runs.";
  if (!hasWorldView(view)) return bands;
  return view.hasRunLines
    ? `Click a line to see that generation of its run. ${bands}`
    : `Click a curve to see that generation of its typical run. ${bands}`;
}

/** Return one row per generation of each curve. */
function listMeanRows(generations, series) {
  return series.flatMap(({ label, values, low, high }) =>
    generations.map((generation, index) => ({
      curve: label,
      generation,
      mean: values[index],
      low: low[index],
      high: high[index],
    })),
  );
}

function listRunRows(generations, series) {
  return series.flatMap(({ label, runs = [] }) =>
    runs.flatMap(({ run, values }) =>
      generations
        .map((generation, index) => ({ curve: label, run, generation, value: values[index] }))
        .filter(({ value }) => value !== null),
    ),
  );
}

export function drawCurves(
  root,
  { study, results, measure, hidden, navigate, choose, by, groups, hasRunLines, load },
  setHidden,
) {
  const plot = el("div");
  let series = groups.map(({ label, conditions }, number) => {
    const { mean, low, high } = combineCurves(
      conditions.map((name) => results.curves[name][measure]),
    );
    return { label, values: mean, low, high, ...selectSeriesStyle(number) };
  });
  const chart = createLineChart(plot, {
    title: `${describeMeasures(results)[measure].title}, generation by generation`,
    x: results.generation,
    xLabel: "generation",
    yLabel: describeMeasures(results)[measure].axis,
    height: 320,
    series,
    hidden: hidden ? hidden.split(",") : [],
    onHidden(labels) {
      setHidden(labels.join(","));
      navigate({ hidden: labels.join(",") || null });
    },
    onPick({ x, label, run }) {
      const { conditions } = groups.find((group) => group.label === label);
      if (conditions.length > 1)
        return choose({ [`only.${by}`]: label, group: null, hidden: null });
      if (!hasWorldView({ study }, conditions[0]))
        return showMessage("This model has no world to show.");
      location.hash = formatLifetimeAddress({
        study: study.id,
        condition: conditions[0],
        run: run ?? results.typical_run[conditions[0]],
        generation: x,
      });
    },
  });
  const saves = createChartDownloads(
    "curves",
    ["curve", "generation", "mean", "low", "high"],
    () => listMeanRows(results.generation, series),
    chart.svg,
  );
  root.append(plot, saves);
  let isDestroyed = false;
  const status = el("span", { class: "soft" }, "Reading the runs …");
  const addRuns = async () => {
    saves.append(status);
    const runs = await Promise.all(
      groups.map(({ conditions: [condition] }) =>
        load(`/api/results/runs?${new URLSearchParams({ study: study.id, condition, measure })}`),
      ),
    );
    if (isDestroyed) return;
    series = series.map((line, number) => ({
      ...line,
      runs: Object.entries(runs[number]).map(([run, values]) => ({
        run: Number(run),
        values: results.generation.map((_, index) => values[index] ?? null),
      })),
    }));
    chart.update(results.generation, series);
    status.replaceWith(
      createDownloadButton("run-curves.csv", () =>
        formatCsv(["curve", "run", "generation", "value"], listRunRows(results.generation, series)),
      ),
    );
  };
  if (hasRunLines) addRuns().catch((error) => isDestroyed || (status.textContent = error.message));
  return {
    destroy() {
      isDestroyed = true;
      chart.destroy();
    },
  };
}
