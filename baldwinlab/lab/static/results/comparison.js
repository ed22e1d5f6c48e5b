/** The comparison of conditions: the sentences, headings and cells that the server writes. */

import { createFold, createTableHead, el } from "../core/common.js";

const TONES = { higher: "good", lower: "warm" };

/**
 * @typedef {object} Comparison as `record_contrasts` returns it
 * @property {string[]} summary sentences, the most important one first
 * @property {string} statistic what the numbers of the sentences are
 * @property {string} pairing
 * @property {string} too_few a sentence, or ""
 * @property {string} method
 * @property {Object<string, string>} headings of the first table, by key of the cells
 * @property {Object<string, string>} test_headings of the folded table
 * @property {{verdict: string, note: string, cells: Object<string, string>}[]} rows
 */

/**
 * Return the answer of a comparison, or "" for a study of one condition.
 * @param {Comparison|undefined} comparison
 */
export function formatAnswer(comparison) {
  return comparison?.summary[0] ?? "";
}

/**
 * Return the table of a comparison.
 * @param {Comparison|undefined} comparison
 * @param {boolean} isOpen at first
 */
export function createComparisonTable(comparison, isOpen) {
  if (!comparison?.rows.length) return comparison?.pairing ? el("p", {}, comparison.pairing) : "";
  const { summary, statistic, pairing, method, too_few: tooFew, headings, rows } = comparison;
  return createFold(
    "comparison",
    "Comparison",
    isOpen,
    tooFew && el("p", {}, tooFew),
    ...summary.slice(1).map((sentence) => el("p", {}, sentence)),
    el("p", { class: "soft" }, statistic),
    createTable("Comparison of conditions", headings, rows),
    createDetails(
      "Tests: p, corrected p and A12",
      createTable("Tests", comparison.test_headings, rows),
    ),
    createDetails("How to read this table", el("p", { class: "soft" }, `${pairing} ${method}`)),
  );
}

function createDetails(title, ...content) {
  return el("details", {}, el("summary", {}, title), ...content);
}

function createTable(label, headings, rows) {
  return el(
    "div",
    { class: "results-comparison", tabindex: "0", role: "region", "aria-label": label },
    el(
      "table",
      {},
      createTableHead(Object.values(headings)),
      el("tbody", {}, ...rows.map((row) => createComparisonRow(row, Object.keys(headings)))),
    ),
  );
}

function createComparisonRow({ verdict, note, cells }, keys) {
  const contents = {
    ...cells,
    verdict: el("span", { class: `badge ${TONES[verdict] ?? ""}` }, verdict),
  };
  return el(
    "tr",
    {},
    el("th", { scope: "row" }, cells.condition, el("small", {}, cells.context)),
    ...keys
      .slice(1)
      .map((key) =>
        el(
          "td",
          {},
          contents[key],
          ...(key === "effect" && note ? [el("small", {}, note)] : []),
        )
      ),
  );
}
