/** A sortable table of all runs, with a CSV download. */

import { createButton, el, formatNumber } from "../core/common.js";
import { createDownloadButton, formatCsv } from "../core/downloads.js";
import { createFreezerButton } from "../world/freezer_button.js";
import { findLastLifetime, findRuns, hasWorldView } from "./results_measures.js";
import { formatLifetimeAddress } from "../core/sources.js";

const MEASURE_COLUMNS = ["best", "mean", "share"];
const COLUMNS = ["condition", "run", ...MEASURE_COLUMNS];

/**
 * Return the table of all runs of the visible conditions, in a closed section.
 * @param {import("./view_results.js").ResultsState} view
 */
export function createRunTable(view) {
  const table = new RunTable(view);
  return el(
    "details",
    { "data-testid": "runs", ontoggle: () => table.showOnce() },
    el("summary", {}, `All runs (${table.rows.length}), averaged over the last ten generations`),
    el(
      "div",
      { class: "results-runs", tabindex: "0", role: "region", "aria-label": "All runs" },
      table.element,
    ),
    createDownloadButton("runs.csv", () => formatCsv(COLUMNS, table.rows)),
  );
}

/** Return one row per run of a condition, with the final value of each measure. */
function listRunRows({ study, results }, condition) {
  return findRuns(study, condition).map((run, index) => {
    const finalValues = MEASURE_COLUMNS.map((measure) => [
      measure,
      results.final[condition][measure][index],
    ]);
    return { condition, run, ...Object.fromEntries(finalValues) };
  });
}

class RunTable {
  constructor(view) {
    const conditions = view.groups.flatMap((group) => group.conditions);
    this.view = view;
    this.rows = conditions.flatMap((condition) => listRunRows(view, condition));
    this.sortColumn = "mean";
    this.isAscending = false;
    this.body = el("tbody");
    this.heads = COLUMNS.map((column) => this.createHead(column, view.results.measures[column]));
    this.element = el("table", {}, el("thead", {}, el("tr", {}, ...this.heads)), this.body);
  }

  /** Return the head of a column. A click sorts the table. */
  createHead(column, measure) {
    const title = measure ? `${measure.name}, ${measure.axis}` : column;
    const button = createButton(title, () => this.sort(column), {
      class: "quiet",
      "data-testid": `sort-${column}`,
    });
    return el("th", { scope: "col" }, button);
  }

  /** Sort by a column. Names and runs are ascending at first, measures descending. */
  sort(column) {
    const isSameColumn = column === this.sortColumn;
    this.isAscending = isSameColumn ? !this.isAscending : !MEASURE_COLUMNS.includes(column);
    this.sortColumn = column;
    this.show();
  }

  /** Show the rows when the section is opened for the first time. */
  showOnce() {
    if (!this.body.firstChild) this.show();
  }

  show() {
    const { sortColumn, isAscending } = this;
    const sign = isAscending ? 1 : -1;
    const sorted = this.rows.toSorted(
      (first, second) => sign * compareValues(first[sortColumn], second[sortColumn]),
    );
    const direction = isAscending ? "ascending" : "descending";
    this.heads.forEach((head, number) =>
      head.setAttribute("aria-sort", COLUMNS[number] === sortColumn ? direction : "none")
    );
    this.body.replaceChildren(...sorted.map((row) => createRunRow(this.view, row)));
  }
}

/** Return a row with a link to the last lifetime, if its model has a world. */
function createRunRow(view, row) {
  const life = hasWorldView(view, row.condition) &&
    findLastLifetime(view, row.condition, row.run);
  const run = life ? el("a", { href: formatLifetimeAddress(life) }, row.run) : row.run;
  return el(
    "tr",
    {},
    el("th", { scope: "row" }, row.condition),
    el("td", {}, run, life && createRunKeepButton(life)),
    ...MEASURE_COLUMNS.map((measure) => el("td", {}, formatNumber(row[measure]))),
  );
}

/** Return the button that stores the last generation of a run. */
function createRunKeepButton(source) {
  const { condition, run } = source;
  const label = `Keep the last generation of ${condition}, run ${run}`;
  return createFreezerButton(label, `keep-run-${condition}-${run}`, () => ({ source }));
}

function compareValues(first, second) {
  if (first === second) return 0;
  return first > second ? 1 : -1;
}
