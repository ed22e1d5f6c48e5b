/**
 * Draw agents as darts, or as the shapes of their species. An agent is filled after the first meal,
 * and has a flash for each meal. The selected agent has a ring.
 */

import { formatColor, palette, resolveColor } from "../core/palette.js";
import { createSvg } from "../core/drawing.js";

// In map units. A body has a length of about ten units.
const DART_CORNERS = [
  [6.4, 0],
  [-4.6, 4.4],
  [-2.4, 0],
  [-4.6, -4.4],
];
// The part inside the outline of an agent that has not eaten.
const HOLLOW_CORNERS = [
  [3.1, 0],
  [-2.9, 2.8],
  [-1.1, 0],
  [-2.9, -2.8],
];
// Number of steps that a flash lasts.
const FLASH_STEPS = 24;
// With more agents, outlines are not stroked, and counts are drawn only at a large scale.
const MAX_DETAILED_AGENTS = 60;

/**
 * Draw all agents. One path per agent is several times faster than one path for a thousand agents.
 * @param {import("./world_view.js").WorldView} view
 */
export function drawAgents(view, recording, step, selectedAgent) {
  const { scale, count } = view;
  // A dart is thinner than a body, so it has a minimum size.
  const size = Math.max(1.15, 1.15 / scale);
  drawFlashes(view, recording, step, size);
  const countEaten = (agent) => recording.countEaten(step + 1, agent);
  if (recording.header.species) drawSpecies(view, recording, countEaten, size);
  else
    for (const hasEaten of [false, true])
      drawDarts(view, (agent) => countEaten(agent) > 0 === hasEaten, hasEaten, size);
  drawTeacherLinks(view, recording, step, selectedAgent);
  if (selectedAgent != null && selectedAgent < count) drawSelectionRing(view, selectedAgent, size);
  if (scale > 1.7 && (count <= MAX_DETAILED_AGENTS || scale > 5)) drawCounts(view, recording, step);
}

function drawDarts({ pen, x, y, angle, count, scale }, isIncluded, hasEaten, size) {
  const isCrowd = count > MAX_DETAILED_AGENTS;
  const hungryColor = isCrowd ? palette.outline : palette.hungry;
  pen.lineWidth = (hasEaten ? 0.8 : 1.4) / scale;
  pen.strokeStyle = hasEaten ? palette.map : palette.outline;
  for (let agent = 0; agent < count; agent++) {
    if (!isIncluded(agent)) continue;
    pen.fillStyle = hasEaten ? palette.agent : hungryColor;
    tracePolygon(pen, DART_CORNERS, x[agent], y[agent], angle[agent], size);
    pen.fill();
    if (!isCrowd) pen.stroke();
    else if (!hasEaten) {
      pen.fillStyle = palette.hungry;
      tracePolygon(pen, HOLLOW_CORNERS, x[agent], y[agent], angle[agent], size);
      pen.fill();
    }
  }
}

function tracePolygon(pen, corners, x, y, angle, size) {
  const cos = Math.cos(angle) * size;
  const sin = Math.sin(angle) * size;
  pen.beginPath();
  for (const [along, across] of corners)
    pen.lineTo(x + along * cos - across * sin, y + along * sin + across * cos);
  pen.closePath();
}

function drawFlashes({ pen, x, y, count }, recording, step, size) {
  const before = Math.max(recording.first, step + 1 - FLASH_STEPS);
  pen.fillStyle = palette.flash;
  pen.globalAlpha = 0.4;
  for (let agent = 0; agent < count; agent++) {
    if (recording.countEaten(step + 1, agent) === recording.countEaten(before, agent)) continue;
    pen.beginPath();
    pen.arc(x[agent], y[agent], 9.5 * size, 0, 2 * Math.PI);
    pen.fill();
  }
  pen.globalAlpha = 1;
}

/**
 * Draw dotted lines from learners to teachers, along the shorter way. If an agent is selected, draw
 * only its lines.
 */
function drawTeacherLinks({ pen, x, y, count, scale, world }, recording, step, selectedAgent) {
  pen.strokeStyle = palette.lesson;
  pen.lineWidth = 1.4 / scale;
  pen.setLineDash([1.5 / scale, 3.5 / scale]);
  for (let learner = 0; learner < count; learner++) {
    const teacher = recording.findTeacher(step, learner);
    if (
      teacher === null ||
      (selectedAgent != null && selectedAgent !== learner && selectedAgent !== teacher)
    )
      continue;
    const across = shortestDistance(x[teacher] - x[learner], world.width);
    const down = shortestDistance(y[teacher] - y[learner], world.height);
    pen.beginPath();
    pen.moveTo(x[learner], y[learner]);
    pen.lineTo(x[learner] + across, y[learner] + down);
    // The other end of a line that leaves the map.
    pen.moveTo(x[teacher] - across, y[teacher] - down);
    pen.lineTo(x[teacher], y[teacher]);
    pen.stroke();
  }
  pen.setLineDash([]);
}

/** Return the shorter of the two distances on a circle of this size. */
export function shortestDistance(distance, size) {
  if (distance > size / 2) return distance - size;
  return distance < -size / 2 ? distance + size : distance;
}

function drawSelectionRing({ pen, x, y, scale }, agent, size) {
  pen.strokeStyle = palette.chosen;
  pen.lineWidth = 2 / scale;
  pen.beginPath();
  pen.arc(x[agent], y[agent], 11 * size, 0, 2 * Math.PI);
  pen.stroke();
}

function drawCounts({ pen, x, y, count, scale }, recording, step) {
  pen.fillStyle = palette.text;
  pen.font = `600 ${11 / scale}px ${palette.font}`;
  pen.textAlign = "left";
  pen.textBaseline = "middle";
  for (let agent = 0; agent < count; agent++) {
    const eaten = recording.countEaten(step + 1, agent);
    if (eaten) pen.fillText(String(eaten), x[agent] + 9, y[agent] - 7);
  }
}

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
function drawSpecies({ pen, x, y, angle, count, scale }, recording, countEaten, size) {
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
