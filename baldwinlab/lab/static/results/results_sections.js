/** The controls at the top of the Results tab, and its folded sections. */

import { createRunSwitch } from "../charts/chart_legend.js";
import { createButton, createSelect, el } from "../core/common.js";
import { createFigureLinks } from "../core/downloads.js";
import { createReactionNorms } from "./reaction_norms.js";
import { drawBoxes, hasReportBoxes } from "./results_boxes.js";
import { createFactorLists } from "./results_factors.js";
import { createRunTable } from "./results_runs.js";

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
    this.element = el(
      "details",
      { class: "card", open: isOpen, "data-testid": id, ontoggle: () => this.drawOnce() },
      el("summary", {}, el("h2", {}, title)),
      this.content,
    );
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
  return el(
    "details",
    { class: "card", open: isOpen, "data-testid": "factors" },
    el("summary", {}, el("h2", {}, "Conditions")),
    lists ?? "",
    canShowRuns && runSwitch,
  );
}
