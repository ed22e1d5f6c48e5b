/** A sortable table of all runs, with a CSV download. */

import { createButton, el, formatNumber } from "./common.js";
import { createDownloadButton, formatCsv } from "./downloads.js";
import { createFreezerButton } from "./freezer_button.js";

const MEASURE_COLUMNS = ["best", "mean", "share"];
const COLUMNS = ["condition", "run", ...MEASURE_COLUMNS];

/**
 * Return the table of all runs, in a closed section.
 * @param {object} results
 * @param {Object<string, number[]>} runs of each visible condition
 * @param {Object<string, {name: string, axis: string}>} measures labels of best, mean and share
 * @param {(condition: string, run: number) => string|null} formatAddress returns the address of the
 *   last lifetime of a run, or null
 */
export function createRunTable(results, runs, measures, formatAddress) {
  const table = new RunTable(listRunRows(results, runs), measures, formatAddress);
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

/** Return one row per run, with the final value of each measure. */
function listRunRows(results, runs) {
  return Object.entries(runs).flatMap(([condition, numbers]) =>
    numbers.map((run, index) => {
      const finalValues = MEASURE_COLUMNS.map((measure) => [
        measure,
        results.final[condition][measure][index],
      ]);
      return { condition, run, ...Object.fromEntries(finalValues) };
    })
  );
}

class RunTable {
  constructor(rows, measures, formatAddress) {
    this.rows = rows;
    this.formatAddress = formatAddress;
    this.sortColumn = "mean";
    this.isAscending = false;
    this.body = el("tbody");
    this.heads = COLUMNS.map((column) => this.createHead(column, measures[column]));
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
    this.body.replaceChildren(
      ...sorted.map((row) => createRunRow(row, this.formatAddress(row.condition, row.run))),
    );
  }
}

function createRunRow(row, address) {
  const run = address ? el("a", { href: address }, row.run) : row.run;
  return el(
    "tr",
    {},
    el("th", { scope: "row" }, row.condition),
    el("td", {}, run, address && createRunKeepButton(address)),
    ...MEASURE_COLUMNS.map((measure) => el("td", {}, formatNumber(row[measure]))),
  );
}

/** Return the button that stores the last generation of a run. */
function createRunKeepButton(address) {
  const source = Object.fromEntries(new URLSearchParams(address.split("?")[1]));
  const label = `Keep the last generation of ${source.condition}, run ${source.run}`;
  return createFreezerButton(
    label,
    `keep-run-${source.condition}-${source.run}`,
    () => ({ source }),
  );
}

function compareValues(first, second) {
  if (first === second) return 0;
  return first > second ? 1 : -1;
}
