/** The curves of each species, generation by generation. */

import { selectSeriesStyle } from "./chart_series.js";
import { LineChart } from "./charts.js";
import { el } from "./common.js";
import { createChartDownloads } from "./downloads.js";
import { combineCurves } from "./results_factors.js";

const CSV_COLUMNS = ["curve", "generation", "mean", "low", "high"];
// The charts, by curve: title, and label of the vertical axis.
const CHARTS = {
  mean: ["Fitness of the average agent of each species", "fitness"],
  share: ["Share of agents of each species with fitness above 0", "share"],
  size: ["Agents of each species", "agents"],
  survivors: ["Agents of each species that are alive at the end of a lifetime", "agents"],
};

/**
 * Return a card with a chart for each curve, or null for a study without species. The charts are
 * drawn by `drawSpeciesCharts`.
 * @param {import("./view_results.js").ResultsState} view
 */
export function createSpeciesCards({ results, groups }) {
  const conditions = groups.flatMap((group) => group.conditions);
  const names = Object.keys(CHARTS).filter((name) =>
    conditions.some((condition) => results.species?.[condition]?.[name]),
  );
  if (!names.length) return null;
  const cards = names.map((name) =>
    el("section", { class: "card", "data-testid": `species-${name}`, "data-curve": name }),
  );
  return el("div", { class: "results-boxes" }, ...cards);
}

/** Draw the charts of the cards, and return them. Charts need the width of their cards. */
export function drawSpeciesCharts(cards, { results, groups }) {
  return [...(cards?.children ?? [])].map((card) => {
    const name = card.dataset.curve;
    const [title, yLabel] = CHARTS[name];
    const series = groups.flatMap((group, number) =>
      createGroupSeries(results.species, group, number, name, groups.length === 1),
    );
    const plot = el("div");
    const chart = new LineChart(plot, {
      title,
      x: results.generation,
      xLabel: "generation",
      yLabel,
      series,
    });
    const rows = () => series.flatMap((line) => listRows(results.generation, line));
    card.append(
      plot,
      createChartDownloads(`species-${name}`, CSV_COLUMNS, rows, () => chart.drawFile()),
    );
    return chart;
  });
}

/**
 * Return a series for each species of a group of conditions. The color shows the group, and the
 * dash the species. A single group has a color for each species.
 */
function createGroupSeries(species, { label, conditions }, number, name, isSingle) {
  const curves = conditions.flatMap((condition) => species[condition]?.[name] ?? []);
  const names = [...new Set(curves.flatMap((curve) => Object.keys(curve)))];
  return names.map((speciesName, index) => {
    const { mean, low, high } = combineCurves(
      curves.flatMap((curve) => curve[speciesName] ?? []),
    );
    const style = selectSeriesStyle(isSingle ? index : number);
    return {
      label: isSingle ? speciesName : `${label}, ${speciesName}`,
      values: mean,
      low,
      high,
      color: style.color,
      dash: selectSeriesStyle(index).dash,
    };
  });
}

function listRows(generations, { label, values, low, high }) {
  return generations.map((generation, index) => ({
    curve: label,
    generation,
    mean: values[index],
    low: low[index],
    high: high[index],
  }));
}
