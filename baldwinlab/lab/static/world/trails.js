/** Draw the paths of agents from the arrays of a recording. */

// From the oldest quarter of a recent trail to the newest.
const OPACITIES = [0.12, 0.22, 0.36, 0.55];
const RECENT_STEPS = 220;
// Maximum per frame, so trails are shorter for a large population.
const MAX_RECENT_SEGMENTS = 9000;
// With more agents, trails are short and use every fourth position.
const MANY_AGENTS = 300;
// Maximum per frame.
const MAX_LIFE_SEGMENTS = 24000;
// Relative to the map. A longer move between two positions is a jump across the edge.
const MAX_JUMP_SHARE = 1 / 8;
// Map units per step, for small maps.
const MIN_JUMP_DISTANCE = 10;

/** Draw fading paths of all agents over the last steps. `pen` uses map units. */
export function drawRecentTrails(pen, recording, step, color, width) {
  const isCrowd = recording.agents > MANY_AGENTS;
  const length = isCrowd
    ? 16
    : Math.min(RECENT_STEPS, Math.floor(MAX_RECENT_SEGMENTS / recording.agents));
  const row = step - recording.first;
  pen.strokeStyle = color;
  pen.lineWidth = width;
  for (let band = 0; band < OPACITIES.length; band++) {
    const from = Math.max(
      0,
      row - Math.round((length * (OPACITIES.length - band)) / OPACITIES.length),
    );
    const to = row - Math.round((length * (OPACITIES.length - band - 1)) / OPACITIES.length);
    if (to <= from) continue;
    pen.globalAlpha = OPACITIES[band];
    pen.beginPath();
    for (let agent = 0; agent < recording.agents; agent++)
      tracePath(pen, recording, agent, from, to, isCrowd ? 4 : 1);
    pen.stroke();
  }
  pen.globalAlpha = 1;
}

/** Draw the path of one agent from the beginning of the recording to a step. */
export function drawAgentTrail(pen, recording, step, agent, color, width) {
  pen.strokeStyle = color;
  pen.lineWidth = width;
  pen.globalAlpha = 0.75;
  pen.beginPath();
  tracePath(pen, recording, agent, 0, step - recording.first);
  pen.stroke();
  pen.globalAlpha = 1;
}

/**
 * Add the rows `from` to `to` of an agent's path. Jumps across the edge and births break the line.
 */
function tracePath(
  pen,
  { agents, arrays: { x, y }, header: { world } },
  agent,
  from,
  to,
  interval = 1,
) {
  const [maxX, maxY] = [world.width, world.height].map((span) =>
    Math.min(span / 2, Math.max(span * MAX_JUMP_SHARE, MIN_JUMP_DISTANCE * interval))
  );
  let index = from * agents + agent;
  let oldX = x[index];
  let oldY = y[index];
  pen.moveTo(oldX, oldY);
  for (let row = from + interval; row <= to; row += interval) {
    index += agents * interval;
    const newX = x[index];
    const newY = y[index];
    if (Math.abs(newX - oldX) > maxX || Math.abs(newY - oldY) > maxY) pen.moveTo(newX, newY);
    else pen.lineTo(newX, newY);
    oldX = newX;
    oldY = newY;
  }
}

/** Complete paths on a separate layer, which grows while the camera does not move. */
export class LifeTrails {
  constructor() {
    this.layer = null;
    this.key = [];
    // The number of rows on the layer.
    this.drawnRows = 0;
  }

  /**
   * Draw the paths up to a step onto `canvas`.
   * @returns {boolean} whether they are complete; otherwise the next frame continues
   */
  draw(pen, canvas, transform, recording, step, color, width) {
    const row = step - recording.first;
    const key = [recording, canvas.width, canvas.height, color, ...transform];
    this.layer ??= document.createElement("canvas");
    if (row < this.drawnRows || key.some((value, number) => value !== this.key[number])) {
      this.layer.width = canvas.width;
      this.layer.height = canvas.height;
      this.drawnRows = 0;
      this.key = key;
    }
    const to = Math.min(
      row,
      this.drawnRows + Math.max(1, Math.floor(MAX_LIFE_SEGMENTS / recording.agents)),
    );
    if (to > this.drawnRows) this.extend(transform, recording, to, color, width);
    pen.save();
    pen.setTransform(1, 0, 0, 1, 0, 0);
    pen.drawImage(this.layer, 0, 0);
    pen.restore();
    return this.drawnRows >= row;
  }

  extend(transform, recording, to, color, width) {
    const pen = this.layer.getContext("2d");
    pen.setTransform(transform[0], 0, 0, transform[0], transform[1], transform[2]);
    pen.strokeStyle = color;
    pen.globalAlpha = 0.3;
    pen.lineWidth = width;
    pen.lineJoin = "round";
    for (let agent = 0; agent < recording.agents; agent++) {
      pen.beginPath();
      tracePath(pen, recording, agent, this.drawnRows, to);
      pen.stroke();
    }
    this.drawnRows = to;
  }
}
