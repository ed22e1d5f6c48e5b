/** The curves of a study, generation by generation. */

import { selectSeriesStyle } from "../charts/chart_series.js";
import { addChart, LineChart } from "../charts/charts.js";
import { el, showMessage } from "../core/common.js";
import { computeRange } from "../core/drawing.js";
import {
  createChartDownloads,
  createDownloadButton,
  createFigureLinks,
  CURVE_COLUMNS,
  formatCsv,
  listCurveRows,
} from "../core/downloads.js";
import { Hint } from "../core/hints.js";
import { combineCurves, describeMap, groupConditions } from "./results_factors.js";
import { hasWorldView, listRuns } from "./results_runs.js";
import { formatLifetimeAddress } from "../core/sources.js";

const RUN_COLUMNS = ["curve", "run", "generation", "value"];

/** Return the meaning of the bands, with the number of runs. */
function explainBands(view) {
  const { groups, hasSingleConditions, by } = view;
  if (!hasSingleConditions)
    return `Curves: means of the conditions by ${by}. Bands: from the lowest to the highest condition.`;
  const runs = groups.map(({ conditions }) => listRuns(view, conditions).length);
  const range = [...new Set([Math.min(...runs), Math.max(...runs)])].join(" to ");
  return `Bands: 95 % intervals of the median, ${range} runs.`;
}

/** Return what the curves show. */
export function explainCurves(view) {
  const hint = view.hasSingleConditions ? "" : " Click a curve to see its conditions.";
  return `${explainBands(view)}${hint}`;
}

function listRunRows(generations, series) {
  return series.flatMap(({ label, runs = [] }) =>
    runs.flatMap(({ run, values }) =>
      generations
        .map((generation, index) => ({ curve: label, run, generation, value: values[index] }))
        .filter(({ value }) => value !== null)
    )
  );
}

/** The charts of the curves: one, or one for each map. */
export class ResultsCurves {
  /**
   * @param {HTMLElement} root is filled
   * @param {import("./view_results.js").ResultsState} view
   * @param {(labels: string) => void} setHidden called with the hidden labels, joined by commas
   */
  constructor(root, view, setHidden) {
    this.view = view;
    this.setHidden = setHidden;
    this.isDestroyed = false;
    const plots = view.panels.map(() => el("div"));
    this.downloads = el("div", { class: "row" }, ...this.createDownloads());
    this.hint = new Hint("curve", () => root.querySelector(".chart-plot"));
    const [{ conditions: [condition] }] = view.groups;
    const opensWorld = view.hasSingleConditions && hasWorldView(view, condition);
    root.append(
      el("div", { class: "results-panels" }, ...plots),
      el("div", { hidden: !opensWorld }, this.hint.element),
      this.downloads,
    );
    const { results, measure } = view;
    // [panel]
    this.series = view.panels.map(({ groups }) => createMedianSeries(results, measure, groups));
    // Charts need the width of their elements on the page.
    this.charts = view.panels.map((panel, number) =>
      this.createChart(plots[number], panel, this.series[number])
    );
    if (view.hasRunLines) this.addRuns();
  }

  /** Return links to the report's figure. Curves that it does not have are saved by the page. */
  createDownloads() {
    const { study, panels, results, measure, hasSingleConditions, hasRunLines } = this.view;
    if (results.swept && !hasRunLines) return [createFigureLinks(study.id, "responses", [])];
    if (hasSingleConditions && !hasRunLines)
      return [createFigureLinks(study.id, "fitness", this.listVisible(), { measure })];
    return panels.map(({ map }, number) =>
      createChartDownloads(
        map ? `curves-${map}` : "curves",
        CURVE_COLUMNS,
        () => listCurveRows(results.generation, this.charts[number].series),
        () => this.charts[number].drawPicture(),
      )
    );
  }

  /** Return the conditions with a visible curve, or all if none is visible. */
  listVisible() {
    const { groups, hidden } = this.view;
    const labels = hidden ? hidden.split(",") : [];
    const visible = groups.filter(({ label }) => !labels.includes(label));
    return (visible.length ? visible : groups).flatMap(({ conditions }) => conditions);
  }

  createChart(plot, { map }, series) {
    const { results, measure, hidden, panels } = this.view;
    const { title, axis } = results.measures[measure];
    const place = describeMap(map);
    return new LineChart(plot, {
      title: map ? place[0].toUpperCase() + place.slice(1) : title,
      label: map ? `${title}, ${place}` : title,
      note: explainBands(this.view),
      x: results.generation,
      xLabel: "generation",
      yLabel: axis,
      height: panels.length > 1 ? 240 : 320,
      series,
      limits: panels.length > 1 ? () => computeLimits(this.series.flat()) : undefined,
      hidden: hidden ? hidden.split(",") : [],
      onHidden: () => this.rememberHidden(),
      onPick: (pick) => this.openPick(pick),
    });
  }

  rememberHidden() {
    const hidden = new Set(this.charts.flatMap((chart) => [...chart.hidden]));
    const labels = [...hidden].join(",");
    this.view.hidden = labels;
    if (!this.view.hasRunLines) this.downloads.replaceChildren(...this.createDownloads());
    this.setHidden(labels);
    this.view.navigate({ hidden: labels || null });
  }

  /** Open the lifetime of a picked curve, or the conditions of a curve that combines several. */
  openPick(/** @type {{x: number, label: string, run?: number}} */ { x, label, run }) {
    const { study, results, by, groups, choose } = this.view;
    this.hint.dismiss();
    const { conditions } = groups.find((group) => group.label === label);
    if (conditions.length > 1) return choose({ [`only.${by}`]: label, group: null, hidden: null });
    const [condition] = conditions;
    if (!hasWorldView({ study }, condition)) return showMessage("This model has no world to show.");
    location.hash = formatLifetimeAddress({
      study: study.id,
      condition,
      run: run ?? results.typical_run[condition],
      generation: x,
    });
  }

  /** Add the lines of runs to the charts, and a download of their values. */
  async addRuns() {
    const status = el("span", { class: "soft" }, "Reading the runs …");
    this.downloads.append(status);
    try {
      const curvesByLabel = await this.loadRuns();
      if (this.isDestroyed) return;
      this.showRuns(curvesByLabel);
      const listRows = () =>
        this.charts.flatMap(({ series }) => listRunRows(this.view.results.generation, series));
      status.replaceWith(
        createDownloadButton("run-curves.csv", () => formatCsv(RUN_COLUMNS, listRows())),
      );
    } catch (error) {
      if (!this.isDestroyed) status.textContent = error.message;
    }
  }

  /** Return the curves of each condition by run, by the label of its curve. */
  async loadRuns() {
    const { study, measure, groups, load } = this.view;
    const entries = groups.map(async ({ label, conditions: [condition] }) => {
      const query = new URLSearchParams({ study: study.id, condition, measure });
      return [label, await load(`api/results/runs?${query}`)];
    });
    return Object.fromEntries(await Promise.all(entries));
  }

  showRuns(curvesByLabel) {
    const { generation: generations } = this.view.results;
    const addRuns = (line) => ({
      ...line,
      runs: Object.entries(curvesByLabel[line.label]).map(([run, values]) => ({
        run: Number(run),
        values: generations.map((_, index) => values[index] ?? null),
      })),
    });
    // All series are known before the first chart computes the limits of its axis.
    this.series = this.series.map((lines) => lines.map(addRuns));
    this.charts.forEach((chart, number) => chart.update(generations, this.series[number]));
  }

  destroy() {
    this.isDestroyed = true;
    for (const chart of this.charts) chart.destroy();
  }
}

/** Return the range of all numbers of some series, so that the panels of maps have one y axis. */
function computeLimits(series) {
  return computeRange(
    ...series.flatMap(({ values, low = [], high = [], runs = [] }) => [
      values,
      low,
      high,
      ...runs.map((run) => run.values),
    ]),
  );
}

/** Draw the average agent of all conditions of a finished comparison, and return the chart. */
export function drawMedians(root, results) {
  const { title, axis } = results.measures.mean;
  const groups = groupConditions(results, {}).groups.map((group, style) => ({ ...group, style }));
  return new LineChart(root, {
    title,
    label: title,
    note: "Medians over runs, with 95 % intervals.",
    x: results.generation,
    xLabel: "generation",
    yLabel: axis,
    height: 260,
    series: createMedianSeries(results, "mean", groups),
  });
}

/** Return one series per group of conditions. */
function createMedianSeries(results, measure, groups) {
  return groups.map(({ label, conditions, style }) => {
    const { center, low, high } = combineCurves(
      conditions.map((name) => results.curves[name][measure]),
    );
    return { label, values: center, low, high, ...selectSeriesStyle(style) };
  });
}

/**
 * Return a card with a chart for each curve, or null for a study without species. The charts are
 * drawn by `drawSpeciesCharts`.
 * @param {import("./view_results.js").ResultsState} view
 */
export function createSpeciesCards({ results, groups }) {
  const conditions = groups.flatMap((group) => group.conditions);
  const names = Object.keys(results.species_curves ?? {}).filter((name) =>
    conditions.some((condition) => results.species[condition]?.[name])
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
    const { title, axis } = results.species_curves[name];
    const series = listSeries(results.species, groups, name);
    const options = { title, x: results.generation, xLabel: "generation", yLabel: axis, series };
    const rows = () => listCurveRows(results.generation, series);
    return addChart(card, options, { name: `species-${name}`, columns: CURVE_COLUMNS, rows });
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
 * @param {{center: number[]}[]} curves of the conditions with the species
 * @param {{label: string, number: number, isSingle: boolean}} group
 * @param {{name: string, index: number}} species
 */
function createSeries(curves, group, species) {
  if (!curves.length) return [];
  const { center, low, high } = combineCurves(curves);
  return [
    {
      label: group.isSingle ? species.name : `${group.label}, ${species.name}`,
      values: center,
      low,
      high,
      color: selectSeriesStyle(group.isSingle ? species.index : group.number).color,
      dash: selectSeriesStyle(species.index).dash,
    },
  ];
}
