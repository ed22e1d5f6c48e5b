/** Draw the visual range of agents, the sectors of their inputs, and active sectors. */

import { palette, resolveColor } from "../core/palette.js";

const DEGREE = Math.PI / 180;
// Levels of brightness. Each level is one path.
const BRIGHTNESS_LEVELS = 4;
// With more agents, only the selected one is drawn, unless discs are large on the canvas.
const MAX_DRAWN_AGENTS = 60;

/**
 * Draw all discs as one path, so that overlapping discs do not add up.
 * @param {import("./world_view.js").WorldView} view
 */
export function drawSensors(view, recording, step, selectedAgent) {
  const { pen, scale } = view;
  const { agents, inputs } = recording;
  const visibleSectors = inputs
    .map(({ sector }, input) => ({ ...sector, input }))
    .filter(({ radius }) => radius);
  if (!visibleSectors.length) return;
  const farthest = Math.max(...visibleSectors.map(({ radius }) => radius));
  const drawsAll = agents <= MAX_DRAWN_AGENTS || farthest * scale > 90;
  const selectedAgents = selectedAgent != null && selectedAgent < agents ? [selectedAgent] : [];
  const visible = drawsAll ? findVisibleAgents(view, farthest) : selectedAgents;
  const drawShape = (draw) => {
    pen.beginPath();
    for (const agent of visible) forEachCopy(view, agent, farthest, (x, y) => draw(agent, x, y));
  };
  const drawSectors = (sectors, isDrawn) =>
    drawShape((agent, x, y) =>
      sectors.forEach(
        (sector) =>
          recording.hasInput(agent, sector.input) &&
          isDrawn(agent, sector) &&
          traceSector(pen, x, y, view.angle[agent], sector),
      )
    );
  drawShape((_agent, x, y) => {
    pen.moveTo(x + farthest, y);
    pen.arc(x, y, farthest, 0, 2 * Math.PI);
  });
  // Blue is the color of a species.
  pen.fillStyle = pen.strokeStyle = recording.header.species ? palette.outline : palette.sight;
  pen.globalAlpha = 0.055;
  pen.fill();
  drawSectors(visibleSectors, () => true);
  pen.lineWidth = 1 / scale;
  pen.globalAlpha = 0.17;
  pen.stroke();
  for (const color of new Set(visibleSectors.map((sector) => sector.color))) {
    const sameColor = visibleSectors.filter((sector) => sector.color === color);
    pen.fillStyle = resolveColor(color);
    for (
      let level = recording.hasNumbers ? 1 : BRIGHTNESS_LEVELS;
      level <= BRIGHTNESS_LEVELS;
      level++
    ) {
      const hasLevel = (agent, { input }) =>
        findBrightness(recording.readInput(step, agent, input)) === level;
      drawSectors(sameColor, hasLevel);
      pen.globalAlpha = (0.42 * level) / BRIGHTNESS_LEVELS;
      pen.fill();
    }
  }
  pen.globalAlpha = 1;
}

function traceSector(pen, x, y, angle, { from_degrees: from, to_degrees: to, radius }) {
  pen.moveTo(x, y);
  pen.arc(x, y, radius, angle + from * DEGREE, angle + to * DEGREE);
  pen.closePath();
}

/** Return the agents whose visual range can be visible on the canvas. */
function findVisibleAgents(view, radius) {
  const { width, height } = view.world;
  const [left, top] = view.convertToMap(0, 0);
  const [right, bottom] = view.convertToMap(view.width, view.height);
  const near = [];
  for (let agent = 0; agent < view.count; agent++) {
    const x = view.x[agent];
    const y = view.y[agent];
    const isNearEdge = x < radius || y < radius || x > width - radius || y > height - radius;
    if (
      isNearEdge ||
      (x > left - radius && x < right + radius && y > top - radius && y < bottom + radius)
    )
      near.push(agent);
  }
  return near;
}

/** Call `draw` for an agent, and for its copies across the edges of the torus. */
function forEachCopy({ x: allX, y: allY, world: { width, height } }, agent, radius, draw) {
  const x = allX[agent];
  const y = allY[agent];
  const acrossX = findCopyOffset(x, radius, width);
  const acrossY = findCopyOffset(y, radius, height);
  draw(x, y);
  if (acrossX) draw(x + acrossX, y);
  if (acrossY) draw(x, y + acrossY);
  if (acrossX && acrossY) draw(x + acrossX, y + acrossY);
}

/** Return the distance to the copy of a position near an edge, or 0. */
function findCopyOffset(position, radius, size) {
  if (position < radius) return size;
  return position > size - radius ? -size : 0;
}

/**
 * Return the level of brightness of an input, which can be any number. 0 is not drawn.
 * @param {number} value
 */
function findBrightness(value) {
  return Math.min(BRIGHTNESS_LEVELS, Math.ceil(BRIGHTNESS_LEVELS * Math.abs(value)));
}
