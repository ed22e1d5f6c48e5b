/** The curves of each species, generation by generation. */

import { selectSeriesStyle } from "../charts/chart_series.js";
import { LineChart } from "../charts/charts.js";
import { el } from "../core/common.js";
import { createChartDownloads, CURVE_COLUMNS, listCurveRows } from "../core/downloads.js";
import { combineCurves } from "./results_factors.js";

// The charts, by curve: title, and label of the vertical axis.
const CHARTS = {
  mean: ["Fitness of the average agent of each species", "fitness"],
  share: ["Share of agents of each species with fitness above 0", "share"],
  composition: ["Shares of the species", "share of the agents"],
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
    conditions.some((condition) => results.species?.[condition]?.[name])
  );
  if (!names.length) return null;
  const cards = names.map((name) =>
    el("section", { class: "card", "data-testid": `species-${name}`, "data-curve": name })
  );
  return el("div", { class: "results-boxes" }, ...cards);
}

/** Draw the charts of the cards, and return them. Charts need the width of their cards. */
export function drawSpeciesCharts(cards, { results, groups }) {
  return [...(cards?.children ?? [])].map((card) => {
    const name = card.dataset.curve;
    const [title, yLabel] = CHARTS[name];
    const series = listSeries(results.species, groups, name);
    const plot = el("div");
    const chart = new LineChart(plot, {
      title,
      x: results.generation,
      xLabel: "generation",
      yLabel,
      series,
    });
    const rows = () => listCurveRows(results.generation, series);
    card.append(
      plot,
      createChartDownloads(`species-${name}`, CURVE_COLUMNS, rows, () => chart.drawPicture()),
    );
    return chart;
  });
}

/** Return the series of all groups of conditions. A species has the same dash in all groups. */
function listSeries(species, groups, curve) {
  const curvesOfGroups = groups.map(({ conditions }) =>
    conditions.flatMap((condition) => species[condition]?.[curve] ?? [])
  );
  const names = [...new Set(curvesOfGroups.flat().flatMap(Object.keys))];
  const isSingle = groups.length === 1;
  return groups.flatMap(({ label }, number) =>
    names.flatMap((name, index) => {
      const curves = curvesOfGroups[number].flatMap((byName) => byName[name] ?? []);
      return createSeries(curves, { label, number, isSingle }, { name, index });
    })
  );
}

/**
 * Return the series of a species in a group of conditions, or none. The color shows the group, and
 * the dash the species. A single group has a color for each species.
 * @param {{mean: number[]}[]} curves of the conditions with the species
 * @param {{label: string, number: number, isSingle: boolean}} group
 * @param {{name: string, index: number}} species
 */
function createSeries(curves, group, species) {
  if (!curves.length) return [];
  const { mean, low, high } = combineCurves(curves);
  return [
    {
      label: group.isSingle ? species.name : `${group.label}, ${species.name}`,
      values: mean,
      low,
      high,
      color: selectSeriesStyle(group.isSingle ? species.index : group.number).color,
      dash: selectSeriesStyle(species.index).dash,
    },
  ];
}
