/** The runs of a study: their table with a CSV download, and their last lifetimes. */

import { createButton, el, formatNumber } from "../core/common.js";
import { createDownloadButton, formatCsv } from "../core/downloads.js";
import { formatLifetimeAddress, isViewable } from "../core/sources.js";

/**
 * @typedef {object} Column of the table, as `lab_results.py` describes it
 * @property {string} key
 * @property {string} title
 * @property {"text"|"number"} format
 * @property {"ascending"|"descending"} order of the first click
 */

/** Return the rows of conditions, with a value per column. */
export function listRuns({ results }, conditions) {
  return results.runs.rows.filter(({ condition }) => conditions.includes(condition));
}

/** Return whether the World tab can show a condition. */
export function hasWorldView({ study }, name) {
  return study.conditions.some((condition) => condition.name === name && isViewable(condition));
}

/** Return the lifetime of the last generation of a run. */
export function findLastLifetime({ study, results }, condition, run) {
  const [{ center }] = Object.values(results.curves[condition]);
  const generation = results.generation[center.findLastIndex((value) => value !== null)];
  return { study: study.id, condition, run, generation };
}

/**
 * Return the table of all runs of the visible conditions, in a closed section.
 * @param {import("./view_results.js").ResultsState} view
 */
export function createRunTable(view) {
  const table = new RunTable(view);
  const keys = table.columns.map(({ key }) => key);
  return el(
    "details",
    { "data-testid": "runs", ontoggle: () => table.showOnce() },
    el("summary", {}, `All runs (${table.rows.length}), ${view.results.runs.note}`),
    el(
      "div",
      { class: "results-runs", tabindex: "0", role: "region", "aria-label": "All runs" },
      table.element,
    ),
    createDownloadButton("runs.csv", () => formatCsv(keys, table.rows)),
  );
}

class RunTable {
  constructor(view) {
    this.view = view;
    this.rows = listRuns(view, view.groups.flatMap((group) => group.conditions));
    /** @type {Column[]} */
    this.columns = view.results.runs.columns;
    this.sorted = this.columns.find(({ key }) => key === view.results.runs.sorted);
    this.order = this.sorted.order;
    this.body = el("tbody");
    this.heads = this.columns.map((column) => this.createHead(column));
    this.element = el("table", {}, el("thead", {}, el("tr", {}, ...this.heads)), this.body);
  }

  /** Return the head of a column. A click sorts the table. */
  createHead(column) {
    const button = createButton(column.title, () => this.sort(column), {
      class: "quiet",
      "data-testid": `sort-${column.key}`,
    });
    return el("th", { scope: "col" }, button);
  }

  /** Sort by a column. A second click reverses the order. */
  sort(column) {
    const reversed = this.order === "ascending" ? "descending" : "ascending";
    this.order = column === this.sorted ? reversed : column.order;
    this.sorted = column;
    this.show();
  }

  /** Show the rows when the section is opened for the first time. */
  showOnce() {
    if (!this.body.firstChild) this.show();
  }

  show() {
    const { sorted: { key }, order, columns, view } = this;
    const sign = order === "ascending" ? 1 : -1;
    const rows = this.rows.toSorted((first, second) =>
      sign * compareValues(first[key], second[key])
    );
    this.heads.forEach((head, number) =>
      head.setAttribute("aria-sort", columns[number].key === key ? order : "none")
    );
    this.body.replaceChildren(
      ...rows.map((row) => el("tr", {}, ...columns.map((column) => createCell(view, row, column)))),
    );
  }
}

/** Return a cell. The condition is the head of its row, and the run is a link. */
function createCell(view, row, { key, format }) {
  if (key === "condition") return el("th", { scope: "row" }, row.condition);
  if (key === "run") return el("td", {}, createRunLink(view, row));
  return el("td", {}, format === "number" ? formatNumber(row[key]) : row[key]);
}

/** Return the number of a run. It links to the last lifetime, if its model has a world. */
function createRunLink(view, { condition, run }) {
  if (!hasWorldView(view, condition)) return run;
  return el("a", { href: formatLifetimeAddress(findLastLifetime(view, condition, run)) }, run);
}

function compareValues(first, second) {
  if (first === second) return 0;
  return first > second ? 1 : -1;
}
