/** The shapes of agents in worlds with several species: on the map, and in the legend. */

import { createSvg } from "../core/drawing.js";
import { formatColor, palette, resolveColor } from "../core/palette.js";

// In map units. A shape keeps its orientation, because a turned square looks like a diamond.
const CORNERS = {
  triangle: [
    [0, -6],
    [5.6, 4],
    [-5.6, 4],
  ],
  square: [
    [4.4, -4.4],
    [4.4, 4.4],
    [-4.4, 4.4],
    [-4.4, -4.4],
  ],
  diamond: [
    [0, -6.2],
    [6.2, 0],
    [0, 6.2],
    [-6.2, 0],
  ],
};
const CIRCLE_RADIUS = 5;
// Length of the line that shows the heading.
const HEADING_LENGTH = 10;
// Size of the part inside the outline of an agent that has not eaten.
const HOLLOW_SIZE = 0.6;

/**
 * Draw each agent as the shape of its species, with a line in its heading.
 * @param {import("./world_view.js").WorldView} view
 * @param {import("./recording.js").Recording} recording
 * @param {(agent: number) => number} countEaten
 */
export function drawSpecies({ pen, x, y, angle, count, scale }, recording, countEaten, size) {
  for (let agent = 0; agent < count; agent++) {
    const { color, shape } = recording.findSpecies(agent);
    pen.fillStyle = pen.strokeStyle = resolveColor(color);
    pen.lineWidth = Math.max(1.6, 1.4 / scale);
    pen.beginPath();
    pen.moveTo(x[agent], y[agent]);
    pen.lineTo(
      x[agent] + HEADING_LENGTH * size * Math.cos(angle[agent]),
      y[agent] + HEADING_LENGTH * size * Math.sin(angle[agent]),
    );
    pen.stroke();
    traceShape(pen, shape, x[agent], y[agent], size);
    pen.fill();
    if (countEaten(agent)) continue;
    pen.fillStyle = palette.hungry;
    traceShape(pen, shape, x[agent], y[agent], size * HOLLOW_SIZE);
    pen.fill();
  }
}

function traceShape(pen, shape, x, y, size) {
  pen.beginPath();
  if (shape === "circle") pen.arc(x, y, CIRCLE_RADIUS * size, 0, 2 * Math.PI);
  else for (const [dx, dy] of CORNERS[shape]) pen.lineTo(x + dx * size, y + dy * size);
  pen.closePath();
}

/** Return the shape of a species for the legend. */
export function drawSpeciesSwatch({ color, shape }) {
  const mark = shape === "circle"
    ? createSvg("circle", { r: CIRCLE_RADIUS })
    : createSvg("polygon", { points: CORNERS[shape].join(" ") });
  const size = { width: 13, height: 13, viewBox: "-7 -7 14 14" };
  const style = `fill: ${formatColor(color)}`;
  return createSvg("svg", { ...size, style, "data-shape": shape, "aria-hidden": "true" }, mark);
}
