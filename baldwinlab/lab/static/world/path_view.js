/**
 * A path: values over the steps of a lifetime, as lines. Without steps, a list of the values at
 * birth.
 */

import { LineChart } from "../charts/charts.js";
import { el, formatNumber } from "../core/common.js";

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
