/** SVG drawings: elements, axis ticks, and complete files. */

import { FONT } from "./palette.js";

const SVG = "http://www.w3.org/2000/svg";
// SVG units above a drawing, for its title.
const HEAD = 40;

export function svg(tag, attributes, ...children) {
  const element = document.createElementNS(SVG, tag);
  for (const [name, value] of Object.entries(attributes)) element.setAttribute(name, value);
  element.append(...children);
  return element;
}

/** Return a line across the plot that is visible on light and dark backgrounds. */
export function gridLine(x1, y1, x2, y2) {
  return svg("line", { x1, y1, x2, y2, stroke: "currentColor", "stroke-opacity": 0.18 });
}

/** Return a text label next to a plot. */
export function textLabel(text, attributes) {
  return svg("text", { fill: "currentColor", "font-size": 12, opacity: 0.85, ...attributes }, text);
}

/** Return the text of a file with a title and a drawing, black on white. */
export function svgFile(title, width, height, drawing) {
  const root = svg(
    "svg",
    {
      width,
      height: height + HEAD,
      viewBox: `0 0 ${width} ${height + HEAD}`,
      color: "black",
      "font-family": FONT,
    },
    svg("title", {}, title),
    svg("rect", { width, height: height + HEAD, fill: "white" }),
    svg("text", { x: 12, y: 24, "font-size": 14, "font-weight": 600 }, title),
    svg("g", { transform: `translate(0 ${HEAD})` }, drawing),
  );
  return `${new XMLSerializer().serializeToString(root)}\n`;
}

/**
 * Return about five ticks from 0 in steps of 1, 2 or 5 x 10^n. The last tick is at or above
 * `highest`.
 */
export function niceTicks(highest) {
  const step = niceStep(highest);
  return multiples(step, 0, Math.ceil(highest / step - 1e-9));
}

/** Return such ticks between two values. No step is smaller than `minStep`. */
export function ticksBetween(low, high, minStep = 0) {
  const step = Math.max(niceStep(high - low || 1), minStep);
  return multiples(step, Math.ceil(low / step - 1e-9), Math.floor(high / step + 1e-9));
}

function niceStep(span) {
  const rough = span / 5;
  const power = 10 ** Math.floor(Math.log10(rough));
  return power * [1, 2, 5, 10].find((factor) => factor * power >= rough);
}

function multiples(step, first, last) {
  return Array.from({ length: Math.max(0, last - first + 1) }, (_, number) =>
    Number(((first + number) * step).toPrecision(12)),
  );
}
