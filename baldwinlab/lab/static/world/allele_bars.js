/**
 * Bars that show the allele frequencies of each locus, and the same data as a table for screen
 * readers.
 */

import { createTableHead, el, formatNumber, Tooltip } from "../core/common.js";
import { createLegendEntry } from "./legend.js";

// The colors of the alleles, in their order.
const COLORS = ["blue", "orange", "green", "purple", "sky", "vermilion"];
// Maximum number of labeled loci.
const MAX_LABELS = 12;
// Possible distances between labeled loci.
const LABEL_DISTANCES = [1, 5, 10, 50, 100, 500, 1000, 5000];

export class AlleleBars {
  constructor() {
    this.heading = el("h2", { "data-testid": "alleles-heading" });
    this.legend = el("div", {
      class: "legend",
      role: "group",
      "aria-label": "Legend, from bottom to top",
      "data-testid": "alleles-legend",
    });
    this.plot = el("div", { class: "allele-plot", "data-testid": "alleles" });
    const scale = el(
      "div",
      { class: "allele-scale number" },
      ["100 %", "50 %", "0 %"].map((text) => el("span", {}, text)),
    );
    this.chart = el(
      "div",
      { class: "allele-chart", "aria-hidden": "true" },
      scale,
      this.plot,
      el("span", { class: "allele-axis" }, "locus"),
    );
    this.table = el("table", { "data-testid": "alleles-table" });
    this.root = el(
      "div",
      { class: "alleles" },
      el("div", { class: "row" }, this.heading, this.legend),
      this.chart,
      el("div", { class: "visually-hidden" }, this.table),
    );
    this.tip = new Tooltip(this.plot);
    this.plot.addEventListener("pointermove", (event) => this.showTooltip(event));
    this.plot.addEventListener("pointerleave", () => this.tip.show(null));
    this.clear();
  }

  /** Remove the bars. */
  clear() {
    this.loci = [];
    this.heading.textContent = "";
    this.plot.replaceChildren(this.tip.element);
    this.tip.show(null);
    this.chart.hidden = this.table.hidden = this.legend.hidden = true;
  }

  /**
   * Set the data.
   * @param {Object<string, any>} header alleles in stacking order, and the first generation
   * @param {Object<string, any>} arrays share [generation, locus, allele]
   */
  setData({ alleles, first, arrays: [{ shape }] }, { share }) {
    this.shares = share;
    this.first = first;
    const drawn = this.loci.length === shape[1] && String(this.alleles) === String(alleles);
    if (!drawn) this.buildBars(alleles, shape[1]);
  }

  buildBars(alleles, count) {
    this.clear();
    this.chart.hidden = this.table.hidden = this.legend.hidden = false;
    this.alleles = alleles;
    this.loci = Array.from({ length: count }, (_, locus) => this.createLocus(locus, count));
    this.plot.prepend(...this.loci.map(({ bar }) => bar));
    const entries = alleles.map((name, number) =>
      createLegendEntry(name, { class: "allele", style: formatColorStyle(number) })
    );
    this.legend.replaceChildren("from bottom to top:", ...entries);
    this.caption = el("caption");
    const lines = this.loci.map(({ line }) => line);
    this.table.replaceChildren(
      this.caption,
      createTableHead(["locus", ...alleles]),
      el("tbody", {}, lines),
    );
  }

  createLocus(locus, count) {
    const parts = this.alleles.map((name, number) =>
      el("i", { class: "allele", style: formatColorStyle(number) }, el("span", {}, name))
    );
    const cells = this.alleles.map(() => el("td"));
    const distance = LABEL_DISTANCES.find((number) => count <= MAX_LABELS * number) ??
      LABEL_DISTANCES.at(-1);
    const number = locus % distance ? "" : locus;
    return {
      parts,
      cells,
      bar: el(
        "div",
        { class: "allele-locus", "data-locus": locus },
        el("div", { class: "allele-bar" }, parts),
        el("span", { class: "number" }, number),
      ),
      line: el("tr", {}, el("th", { scope: "row" }, locus), cells),
    };
  }

  /**
   * Show a generation.
   * @param {number} generation
   */
  show(generation) {
    const { shares } = this;
    this.heading.textContent =
      this.caption.textContent =
        `Alleles by locus, generation ${generation}`;
    const kinds = this.alleles.length;
    this.loci.forEach(({ parts, cells }, locus) => {
      const first = ((generation - this.first) * this.loci.length + locus) * kinds;
      parts.forEach((part, kind) => {
        part.style.flexGrow = shares[first + kind];
        cells[kind].textContent = `${formatNumber(100 * shares[first + kind])} %`;
      });
    });
  }

  /** Show the tooltip of the locus under the pointer. */
  showTooltip({ target, clientX, clientY }) {
    const bar = target.closest("[data-locus]");
    const { left, top } = this.plot.getBoundingClientRect();
    this.tip.show(bar && this.describe(Number(bar.dataset.locus)), clientX - left, clientY - top);
  }

  describe(locus) {
    const { cells } = this.loci[locus];
    const shares = this.alleles.map((name, kind) => `${name} in ${cells[kind].textContent}`);
    return `locus ${locus}: ${shares.join(", ")}`;
  }
}

/** Return the background and text color of an allele. */
function formatColorStyle(number) {
  const color = COLORS[number % COLORS.length];
  return (
    `background: var(--${color}); color: ` +
    `var(--${color === "blue" ? "accent-text" : "on-orange"})`
  );
}
