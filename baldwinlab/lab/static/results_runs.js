/** A sortable table of all runs, with a CSV download. */

import { el, formatNumber } from "./common.js";
import { formatCsv, createDownloadButton } from "./downloads.js";

const COLUMNS = ["condition", "run", "best", "mean", "share"];

/**
 * @param {object} results
 * @param {Object<string, number[]>} runs of each visible condition
 * @param {Object<string, {name: string, axis: string}>} measures labels of best, mean and share
 * @param {(condition: string, run: number) => string|null} address of the last lifetime of a run,
 *   or null
 */
export function createRunTable(results, runs, measures, address) {
  const rows = Object.entries(runs).flatMap(([condition, numbers]) =>
    numbers.map((run, index) => ({
      condition,
      run,
      ...Object.fromEntries(
        COLUMNS.slice(2).map((measure) => [measure, results.final[condition][measure][index]]),
      ),
    })),
  );
  const body = el("tbody");
  const columnTitle = (column) =>
    column in measures ? `${measures[column].name}, ${measures[column].axis}` : column;
  let order = { column: "mean", isRising: false };
  const heads = COLUMNS.map((column) =>
    el(
      "th",
      { scope: "col" },
      el(
        "button",
        {
          type: "button",
          class: "quiet",
          "data-testid": `sort-${column}`,
          onclick: () => sort(column),
        },
        columnTitle(column),
      ),
    ),
  );
  const sort = (column) => {
    order = {
      column,
      isRising:
        order.column === column ? !order.isRising : column === "condition" || column === "run",
    };
    show();
  };
  const show = () => {
    const { column, isRising } = order;
    const sorted = [...rows].sort(
      (first, second) => compareValues(first[column], second[column]) * (isRising ? 1 : -1),
    );
    const direction = isRising ? "ascending" : "descending";
    heads.forEach((head, number) =>
      head.setAttribute("aria-sort", COLUMNS[number] === column ? direction : "none"),
    );
    body.replaceChildren(
      ...sorted.map((row) => createRunRow(row, address(row.condition, row.run))),
    );
  };
  const table = el(
    "div",
    { class: "results-runs", tabindex: "0", role: "region", "aria-label": "All runs" },
    el("table", {}, el("thead", {}, el("tr", {}, ...heads)), body),
  );
  return el(
    "details",
    { class: "card", "data-testid": "runs", ontoggle: () => body.firstChild || show() },
    el("summary", {}, `All runs (${rows.length}), averaged over the last ten generations`),
    table,
    createDownloadButton("runs.csv", () => formatCsv(COLUMNS, rows)),
  );
}

function createRunRow(row, address) {
  const run = address ? el("a", { href: address }, row.run) : row.run;
  return el(
    "tr",
    {},
    el("th", { scope: "row" }, row.condition),
    el("td", {}, run),
    ...COLUMNS.slice(2).map((measure) => el("td", {}, formatNumber(row[measure]))),
  );
}

function compareValues(first, second) {
  if (first === second) return 0;
  return first > second ? 1 : -1;
}
