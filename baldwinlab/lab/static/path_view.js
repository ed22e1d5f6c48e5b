/**
 * A path: values over the steps of a lifetime, as lines. Without steps, a list of the values at
 * birth.
 */

import { LineChart } from "./charts.js";
import { el, formatNumber } from "./common.js";

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
   * @param {{names: string[], step: string, value: string}} header
   * @param {{lines: Float32Array}} arrays [line, step]
   */
  setData({ names, step, value }, { lines }, title) {
    const length = lines.length / names.length;
    const series = names.map((label, line) => ({
      label,
      values: [...lines.slice(line * length, (line + 1) * length)],
    }));
    this.close();
    this.title = title;
    if (length === 1) return this.plot.append(...listBirthValues(names, step, value, lines));
    this.chart = new LineChart(this.plot, {
      title: value,
      x: Array.from({ length }, (_, index) => index),
      xLabel: step,
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

function listBirthValues(names, step, value, lines) {
  const numbers = names.map((name, line) => el("li", {}, `${name}: ${formatNumber(lines[line])}`));
  return [
    el(
      "p",
      {},
      `These lifetimes have no ${step}, so all values stay as they are at birth: ${value}.`,
    ),
    el("ul", {}, ...numbers),
  ];
}
