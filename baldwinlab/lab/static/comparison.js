/** The comparison of conditions: verdict, effect, p-value and number of runs, as in the report. */

import { el, formatNumber } from "./common.js";

const MEASURES = { mean: "average agent", best: "best agent" };
const TONES = { higher: "good", lower: "warm" };
const HEADINGS = ["Condition", "Verdict", "Effect [95 % interval]", "Corrected p", "A12", "Runs"];
// A longer table is folded.
const MAX_OPEN_ROWS = 4;

/**
 * Return the answer of a comparison in one sentence: the average agent of one pair, or the number of
 * pairs with each verdict.
 * @param {{rows: object[]}|undefined} comparison
 */
export function formatAnswer(comparison) {
  const rows = comparison?.rows.filter(({ measure }) => measure === "mean") ?? [];
  if (!rows.length) return "";
  if (rows.length === 1) {
    const [{ condition_a: first, condition_b: second, verdict, effect, p_holm: p, n_a: n }] = rows;
    return (
      `${first} compared with ${second}: ${verdict} (${formatEffect(effect)}, ` +
      `p ${formatP(p)}, ${n} runs).`
    );
  }
  const counts = new Map();
  for (const { verdict } of rows) counts.set(verdict, (counts.get(verdict) ?? 0) + 1);
  if (counts.size === 1)
    return `All ${rows.length} comparisons of the average agent: ${rows[0].verdict}.`;
  const parts = [...counts].map(([verdict, count]) => `${count} ${verdict}`);
  return `Of ${rows.length} comparisons of the average agent: ${parts.join(", ")}.`;
}

function formatEffect(effect) {
  return `${effect > 0 ? "+" : ""}${formatNumber(effect)}`;
}

function formatP(p) {
  return p < 0.001 ? "below 0.001" : p.toFixed(3);
}

/**
 * Return the table of a comparison.
 * @param {{pairing: string, too_few: string, rows: object[]}|undefined} comparison
 */
export function createComparisonTable(comparison) {
  if (!comparison?.rows.length) return "";
  const { pairing, too_few: tooFew, rows } = comparison;
  const table = el(
    "div",
    {
      class: "results-comparison",
      tabindex: "0",
      role: "region",
      "aria-label": "Comparison of conditions",
    },
    el(
      "table",
      {},
      el(
        "thead",
        {},
        el("tr", {}, ...HEADINGS.map((heading) => el("th", { scope: "col" }, heading))),
      ),
      el("tbody", {}, ...rows.map(createComparisonRow)),
    ),
  );
  const explanation =
    "The effect is the difference between the medians of the runs. The p-value is from " +
    "the Mann-Whitney test with Holm's correction. The corrected p-value decides. The interval " +
    "is that of one comparison alone.";
  return el(
    "details",
    { class: "card", open: rows.length <= MAX_OPEN_ROWS, "data-testid": "comparison" },
    el("summary", {}, "Comparison of conditions"),
    el("p", { class: "soft" }, `${pairing} ${explanation}`),
    ...(tooFew ? [el("p", {}, tooFew)] : []),
    table,
  );
}

function createComparisonRow(row) {
  const interval = row.low === null ? "" : ` [${formatNumber(row.low)}, ${formatNumber(row.high)}]`;
  return el(
    "tr",
    {},
    el(
      "th",
      { scope: "row" },
      row.condition_a,
      el("small", {}, `compared with ${row.condition_b}, ${MEASURES[row.measure]}`),
    ),
    el("td", {}, el("span", { class: `badge ${TONES[row.verdict] ?? ""}` }, row.verdict)),
    el(
      "td",
      {},
      `${formatEffect(row.effect)}${interval}`,
      ...(row.note ? [el("small", {}, row.note)] : []),
    ),
    el("td", {}, formatP(row.p_holm)),
    el("td", {}, row.a12.toFixed(2)),
    el("td", {}, `${row.n_a}, ${row.n_b}`),
  );
}
