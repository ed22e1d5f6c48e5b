/** Drawings as SVG: elements, ticks of axes, and a whole picture as a file that needs nothing else. */

import { FONT } from "./palette.js";

const SVG = "http://www.w3.org/2000/svg";
const HEAD = 40; // units above a picture, for its title

export function svg(tag, attributes, ...children) {
  const element = document.createElementNS(SVG, tag);
  for (const [name, value] of Object.entries(attributes)) element.setAttribute(name, value);
  element.append(...children);
  return element;
}

/** A line across the plot, which shows on light and on dark. */
export function gridLine(x1, y1, x2, y2) {
  return svg("line", { x1, y1, x2, y2, stroke: "currentColor", "stroke-opacity": 0.18 });
}

/** A word or a number beside a plot. */
export function textLabel(text, attributes) {
  return svg("text", { fill: "currentColor", "font-size": 12, opacity: 0.85, ...attributes }, text);
}

/** The text of a file with a drawing under its title, black on white, whatever the page's ground is. */
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

/** From nought in steps of 1, 2 or 5 times a power of ten, about five of them, ending at or above `highest`. */
export function niceTicks(highest) {
  const step = niceStep(highest);
  return multiples(step, 0, Math.ceil(highest / step - 1e-9));
}

/** Such steps between two values; none is smaller than `least`. */
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
