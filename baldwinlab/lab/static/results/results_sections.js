/** The controls at the top of the Results tab, and its folded sections. */

import { createRunSwitch, selectSeriesStyle } from "../charts/chart_series.js";
import { createButton, createFold, createSelect, el, formatNumber } from "../core/common.js";
import { createChartDownloads, createFigureLinks } from "../core/downloads.js";
import { createReactionNorms } from "./reaction_norms.js";
import { createFactorLists } from "./results_factors.js";
import { createRunTable, findLastLifetime, hasWorldView, listRuns } from "./results_runs.js";
import { drawBoxChart } from "../charts/svg_charts.js";
import { formatLifetimeAddress } from "../core/sources.js";

// More boxes are below each other.
const MAX_NEIGHBORS = 8;

export function createHeading({ study, studies, choose }) {
  const folder = study.id === "."
    ? ""
    : `${study.id.split("/").map(encodeURIComponent).join("/")}/`;
  const report = study.report &&
    el(
      "a",
      {
        class: "button",
        target: "_blank",
        rel: "noopener",
        "data-testid": "report-link",
        href: `api/report/${folder}report.html`,
      },
      "Full report",
    );
  return el(
    "div",
    { class: "row" },
    createStudyPicker(studies, study.id, choose),
    el("span", { class: "spread" }),
    createCompareLink(study),
    report,
  );
}

/** Return a link to the dialog of comparisons. The presets of the study are ticked. */
function createCompareLink({ conditions }) {
  const presets = conditions.map(({ name }) => name);
  const query = new URLSearchParams({ compare: JSON.stringify({ presets }) });
  return el(
    "a",
    { class: "button", "data-testid": "compare-link", href: `#/live?${query}` },
    "Compare …",
  );
}

export function createStudyPicker(studies, id, choose) {
  const names = studies.map((study) => [study.id, study.id === "." ? "this study" : study.id]);
  const options = id === null ? [["", "choose a study"], ...names] : names;
  return createSelect(options, id, (study) => choose({ study }), {
    "aria-label": "Study",
    "data-testid": "results-study",
  });
}

export function createMeasureSwitch(results, measure, choose) {
  const buttons = Object.entries(results.measures).map(([key, { name }]) =>
    createButton(name, () => choose({ measure: key }), {
      "aria-pressed": String(key === measure),
      "data-testid": `measure-${key}`,
    })
  );
  return el("div", { class: "results-switch", role: "group", "aria-label": "Measure" }, ...buttons);
}

/** A part with a heading. Its charts are drawn at the first opening, when they have a width. */
class Fold {
  /**
   * @param {string} id
   * @param {string} title
   * @param {boolean} isOpen at first
   * @param {(root: HTMLElement) => {destroy: () => void}[]} draw fills an element, and returns its
   *   charts
   */
  constructor(id, title, isOpen, draw) {
    this.draw = draw;
    this.charts = null;
    this.content = el("div");
    this.element = createFold(id, title, isOpen, this.content);
    this.element.addEventListener("toggle", () => this.drawOnce());
  }

  drawOnce() {
    if (this.element.open) this.charts ??= this.draw(this.content);
  }

  destroy() {
    for (const chart of this.charts ?? []) chart.destroy();
  }
}

/** Return the final values of the runs: box plots, and links to the report's figure. */
export function createFinals(view) {
  const { study, groups, results: { compared_measures: measures } } = view;
  return new Fold("finals", "Final values", false, (root) => {
    const boxes = measures.map((measure) => el("section", { "data-testid": `final-${measure}` }));
    const layout = groups.length > MAX_NEIGHBORS ? "results-boxes wide" : "results-boxes";
    root.append(el("div", { class: layout }, ...boxes));
    if (hasReportBoxes(view)) {
      const conditions = groups.flatMap((group) => group.conditions);
      root.append(createFigureLinks(study.id, "final-fitness", conditions));
    }
    root.append(createRunTable(view));
    return measures.map((measure, index) => drawBoxes(boxes[index], view, measure));
  });
}

/** Return the reaction norms, or how to measure them. */
export function createNorms({ study, groups, norm, choose, load }) {
  return new Fold("reaction", "Reaction norms", norm !== undefined, (root) => {
    const response = load(`api/results/reaction?${new URLSearchParams({ study: study.id })}`);
    return [createReactionNorms(root, response, study.argument, groups, norm, choose)];
  });
}

/** Return what selects, groups and splits conditions. It is open while it has an effect. */
export function createFactorSection({ results, by, only, choose, canShowRuns, hasRunLines }) {
  const lists = createFactorLists(results, { by, only }, choose);
  if (!lists && !canShowRuns) return "";
  const runSwitch = createRunSwitch(
    hasRunLines,
    (isChecked) => choose({ runs: isChecked ? "each" : null }),
  );
  const isOpen = hasRunLines || Object.values(only).some(Boolean);
  return createFold("factors", "Conditions", isOpen, lists, canShowRuns && runSwitch);
}

const CSV_COLUMNS = ["box", "condition", "run", "value"];

/**
 * Draw the final values of a measure, with downloads.
 * @param {HTMLElement} root is filled
 * @param {import("./view_results.js").ResultsState} view
 * @param {string} measure
 * @returns {{destroy: () => void}}
 */
function drawBoxes(root, view, measure) {
  const { name, axis } = view.results.measures[measure];
  const boxes = view.groups.map((group) => createBox(view, measure, group));
  const plot = el("div");
  const chart = drawBoxChart(plot, {
    title: `${name} at the end of each run, ${axis}`,
    groups: boxes,
    height: 320,
  });
  root.append(plot);
  // The report has no boxes of several conditions.
  if (!hasReportBoxes(view)) {
    const rows = () =>
      boxes.flatMap(({ label, points }) => points.map((point) => ({ box: label, ...point })));
    root.append(createChartDownloads(`final-${measure}`, CSV_COLUMNS, rows));
  }
  return chart;
}

/** Return whether the report has a figure with the same boxes. */
function hasReportBoxes({ hasSingleConditions, results }) {
  return hasSingleConditions && !results.swept;
}

/** Return the box of a group. Its points link to lifetimes if the conditions have a world. */
function createBox(view, measure, { label, conditions, style }) {
  const points = listRuns(view, conditions)
    .map((row) => ({ condition: row.condition, run: row.run, value: row[measure] }));
  const { axis } = view.results.measures[measure];
  const describe = (index) => {
    const { condition, run, value } = points[index];
    return `${condition}, run ${run}: ${formatNumber(value)} ${axis}`;
  };
  const box = {
    label,
    points,
    values: points.map(({ value }) => value),
    color: selectSeriesStyle(style).color,
    describe,
  };
  if (!hasWorldView(view, conditions[0])) return box;
  const href = (index) => {
    const { condition, run } = points[index];
    return formatLifetimeAddress(findLastLifetime(view, condition, run));
  };
  return { ...box, targetText: "Open the last generation.", href };
}
