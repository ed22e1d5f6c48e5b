/** A table of numbers by row and column. A stronger color means a larger number. */

import { el } from "../core/common.js";

// Percentage of color for the largest number, with readable text.
const MAX_COLOR_SHARE = 55;

export class MatrixView {
  constructor() {
    this.heading = el("h2", { "data-testid": "view-heading" });
    this.table = el("table", { class: "matrix number", "data-testid": "matrix" });
    this.valueLabel = el("p", { class: "soft" });
    const scrolled = el(
      "div",
      { class: "matrix-scroll", tabindex: "0", role: "group", "aria-label": "Matrix" },
      this.table,
    );
    this.root = el("div", { class: "view" }, this.heading, this.valueLabel, scrolled);
  }

  clear() {
    this.heading.textContent = this.valueLabel.textContent = "";
    this.table.replaceChildren();
  }

  /**
   * @param {{rows: string[], columns: string[], value_label: string}} header
   * @param {{values: Float32Array}} arrays [row, column]
   */
  setData({ rows, columns, value_label }, { values }, title) {
    const numbers = [...values].filter((number) => !Number.isNaN(number));
    const minimum = Math.min(...numbers);
    const maximum = Math.max(...numbers);
    const computeShare = (number) => {
      if (Number.isNaN(number)) return 0;
      return maximum > minimum ? (number - minimum) / (maximum - minimum) : 0.5;
    };
    const digits = chooseDigits(numbers, Math.max(-minimum, maximum));
    const formatted = (number) => (Number.isNaN(number) ? "–" : number.toFixed(digits));
    const cell = (number) =>
      el(
        "td",
        {
          style: "background: color-mix(in srgb, var(--sky) " +
            `${Math.round(MAX_COLOR_SHARE * computeShare(number))}%, transparent)`,
        },
        formatted(number),
      );
    const line = (name, row) =>
      el(
        "tr",
        {},
        el("th", { scope: "row" }, name),
        [...values.slice(row * columns.length, (row + 1) * columns.length)].map(cell),
      );
    this.title = title;
    this.valueLabel.textContent = value_label;
    this.table.replaceChildren(
      el(
        "thead",
        {},
        el(
          "tr",
          {},
          el("td"),
          columns.map((name) => el("th", { scope: "col" }, name)),
        ),
      ),
      el("tbody", {}, rows.map(line)),
    );
  }

  show(generation) {
    this.heading.textContent = `${this.title}, generation ${generation}`;
  }
}

/** Return the number of decimals of all numbers, which makes columns comparable. */
function chooseDigits(numbers, maximum) {
  if (numbers.every(Number.isInteger) || maximum >= 100) return 0;
  return maximum >= 10 ? 1 : 2;
}
