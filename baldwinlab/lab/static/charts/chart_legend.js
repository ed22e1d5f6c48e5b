/** The legend of a chart, and the switch that shows each run. */

import { selectSeriesStyle } from "./chart_series.js";
import { createButton, el } from "../core/common.js";
import { createSvg } from "../core/drawing.js";

/**
 * Return a checkbox that shows each run as a thin line.
 * @param {(isChecked: boolean) => void} changed
 */
export function createRunSwitch(checked, changed) {
  const input = el("input", {
    type: "checkbox",
    checked,
    "data-testid": "each-run",
    onchange: () => changed(input.checked),
  });
  return el("label", { class: "inline" }, input, "show each run");
}

export function createLegendEntry(line, number, hidden, toggle) {
  const { color, dash } = { ...selectSeriesStyle(number), ...line };
  return createButton(
    [drawSwatch(color, dash), el("span", {}, line.label), el("span", { class: "chart-value" })],
    () => toggle(line.label),
    { class: "chart-key", "aria-pressed": String(!hidden.has(line.label)) },
  );
}

function drawSwatch(color, dash = []) {
  const line = {
    d: "M0 2H22",
    stroke: color,
    "stroke-width": 3,
    "stroke-dasharray": dash.map((length) => length * 0.8).join(" "),
  };
  return createSvg("svg", { width: 22, height: 4, "aria-hidden": "true" }, createSvg("path", line));
}
