/** The display of a model without a world: loads and draws alleles, matrices, paths and grids. */

import { AlleleBars } from "./allele_bars.js";
import { el, formatNumber, getBinary } from "../core/common.js";
import { GridView } from "./grid_view.js";
import { LineChart } from "../charts/charts.js";

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

export class PathView {
  constructor() {
    this.heading = el("h2", { "data-testid": "view-heading" });
    this.plot = el("div", { "data-testid": "path" });
    this.root = el("div", { class: "view" }, this.heading, this.plot);
  }

  clear() {
    this.close();
    this.heading.textContent = "";
  }

  /**
   * @param {{names: string[], step_label: string, value_label: string}} header
   * @param {{lines: Float32Array}} arrays [line, step]
   */
  setData({ names, step_label, value_label }, { lines }, title) {
    const length = lines.length / names.length;
    const series = names.map((label, line) => ({
      label,
      values: [...lines.slice(line * length, (line + 1) * length)],
    }));
    this.close();
    this.title = title;
    if (length === 1)
      return this.plot.append(...listBirthValues(names, step_label, value_label, lines));
    this.chart = new LineChart(this.plot, {
      title: value_label,
      x: Array.from({ length }, (_, index) => index),
      xLabel: step_label,
      yLabel: "",
      series,
      height: 320,
    });
  }

  show(generation) {
    this.heading.textContent = `${this.title}, generation ${generation}`;
  }

  close() {
    this.chart?.destroy();
    this.chart = null;
    this.plot.replaceChildren();
  }
}

function listBirthValues(names, stepLabel, valueLabel, lines) {
  const numbers = names.map((name, line) => el("li", {}, `${name}: ${formatNumber(lines[line])}`));
  return [
    el(
      "p",
      {},
      `These lifetimes have no ${stepLabel}, so all values stay as they are at birth: ` +
        `${valueLabel}.`,
    ),
    el("ul", {}, ...numbers),
  ];
}

/**
 * @typedef {object} Drawer draws one kind of view
 * @property {HTMLElement} root
 * @property {(header: Object<string, any>, arrays: Object<string, ArrayLike<number>>, title:
 *   string) => void} setData
 * @property {(generation: number) => void} show
 * @property {() => void} clear
 * @property {() => void} [close]
 * @property {import("./time_bar.js").TimeBar} [bar] if the view has steps
 * @property {number} [step]
 */
const DRAWERS = { alleles: AlleleBars, matrix: MatrixView, path: PathView, grid: GridView };

export class ModelDisplay {
  /**
   * @param {(header: Object<string, any>) => string} formatTitle
   * @param {() => void} [moved] called when another step is shown
   */
  constructor(formatTitle, moved = () => {}) {
    this.formatTitle = formatTitle;
    this.moved = moved;
    this.root = el("div", { class: "model-view" });
    /** @type {Drawer|null} */
    this.drawer = null;
    this.header = null;
    this.requestedUrl = null;
    this.generation = 0;
  }

  /**
   * Show a generation of the data at an address. The previous data stay visible until they are
   * loaded.
   * @returns {Promise<boolean>} whether they are shown, unless a later request shows its data;
   *   rejects after an error
   */
  async load(url, generation) {
    this.generation = generation;
    if (url === this.requestedUrl) return this.show();
    this.stop?.abort();
    this.requestedUrl = url;
    this.header = null;
    delete this.root.dataset.ready;
    this.stop = new AbortController();
    try {
      this.setData(await getBinary(url, this.stop.signal));
    } catch (error) {
      if (error.name === "AbortError") return false;
      // Allow another attempt.
      this.requestedUrl = null;
      // Remove the old view, because the selectors show another source.
      this.drawer?.clear();
      throw error;
    }
    return this.show();
  }

  /** Show the requested generation, if the data are loaded. */
  show() {
    if (this.header) this.drawer.show(this.generation);
    return this.header !== null;
  }

  setData({ header, arrays }) {
    const Drawer = DRAWERS[header.kind];
    if (!(this.drawer instanceof Drawer)) {
      this.drawer?.close?.();
      this.drawer = new Drawer(this.moved);
      this.root.replaceChildren(this.drawer.root);
    }
    this.header = header;
    this.drawer.setData(header, arrays, this.formatTitle(header));
    this.root.dataset.ready = "";
  }

  close() {
    this.stop?.abort();
    this.drawer?.close?.();
  }
}
