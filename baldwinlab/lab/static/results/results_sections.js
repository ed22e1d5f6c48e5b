/** The folded sections of the Results tab: conditions, final values, reaction norms. */

import { createRunSwitch } from "../charts/chart_legend.js";
import { el } from "../core/common.js";
import { createFigureLinks } from "../core/downloads.js";
import { createReactionNorms } from "./reaction_norms.js";
import { drawBoxes, hasReportBoxes } from "./results_boxes.js";
import { createFactorLists } from "./results_factors.js";
import { Fold } from "./results_folds.js";
import { createRunTable } from "./results_runs.js";

// More boxes are below each other.
const MAX_NEIGHBORS = 8;
// The measures with a box plot.
/** @type {("best"|"mean")[]} */
const BOX_MEASURES = ["mean", "best"];

/** Return the final values of the runs: box plots, and links to the report's figure. */
export function createFinals(view) {
  const { study, groups } = view;
  return new Fold("finals", "Final values", false, (root) => {
    const boxes = BOX_MEASURES.map((measure) =>
      el("section", { "data-testid": `final-${measure}` })
    );
    const layout = groups.length > MAX_NEIGHBORS ? "results-boxes wide" : "results-boxes";
    root.append(el("div", { class: layout }, ...boxes));
    if (hasReportBoxes(view)) {
      const conditions = groups.flatMap((group) => group.conditions);
      root.append(createFigureLinks(study.id, "final-fitness", conditions));
    }
    root.append(createRunTable(view));
    return BOX_MEASURES.map((measure, index) => drawBoxes(boxes[index], view, measure));
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
