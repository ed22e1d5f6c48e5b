/** Draw a world on a canvas, to scale. Needs only a canvas, so exported pages use it too. */

import { drawAgents, shortestDistance } from "./agents.js";
import { palette, resolveColor } from "../core/palette.js";
import { drawSensors } from "./sensors.js";
import { drawAgentTrail, drawRecentTrails, LifeTrails } from "./trails.js";

// The largest zoom of a map of 640 map units. A larger map has a larger one.
const MAX_ZOOM = 24;
const STANDARD_SIZE = 640;
// The largest zoom in an address, which is opened before the size of the map is known.
const MAX_ADDRESS_ZOOM = 10_000;

/**
 * @typedef {object} DrawOptions
 * @property {number|null} [selectedAgent] the selected agent
 * @property {"off"|"recent"|"life"} [trails]
 * @property {boolean} [sight] whether visual ranges are drawn
 */
export class WorldView {
  /** @param {HTMLCanvasElement} canvas of the size of its box on the page */
  constructor(canvas) {
    this.canvas = canvas;
    this.pen = canvas.getContext("2d", { alpha: false });
    // The center, as a share of the map. Zoom 1 shows the complete map.
    this.camera = { x: 0.5, y: 0.5, zoom: 1 };
    this.world = { width: 640, height: 640, marks: [] };
    this.life = new LifeTrails();
    this.count = 0;
    // The index of each drawn agent in its world, or null if all agents are drawn.
    this.ids = null;
    // Counts the calls of `resize`, which clears the canvas.
    this.resizes = 0;
    this.resize();
  }

  /** Follow the size of the canvas on the page. `resized` must draw again. */
  followSize(resized) {
    this.sized = new ResizeObserver(() => {
      this.resize();
      resized();
    });
    this.sized.observe(this.canvas);
  }

  close() {
    this.sized?.disconnect();
  }

  /** Adapt to the size of the canvas on the page. */
  resize() {
    this.resizes += 1;
    this.pixelRatio = Math.min(globalThis.devicePixelRatio || 1, 2);
    this.width = this.canvas.clientWidth || this.canvas.width;
    this.height = this.canvas.clientHeight || this.canvas.height;
    this.canvas.width = Math.max(1, Math.round(this.width * this.pixelRatio));
    this.canvas.height = Math.max(1, Math.round(this.height * this.pixelRatio));
  }

  /** CSS pixels per map unit. */
  get scale() {
    const margin = Math.min(28, Math.min(this.width, this.height) * 0.03) * 2;
    return (
      this.camera.zoom *
      Math.max(
        0.001,
        Math.min(
          (this.width - margin) / this.world.width,
          (this.height - margin) / this.world.height,
        ),
      )
    );
  }

  /** The position of the map's corner, in CSS pixels. */
  get origin() {
    const { x, y } = this.camera;
    return [
      this.width / 2 - x * this.world.width * this.scale,
      this.height / 2 - y * this.world.height * this.scale,
    ];
  }

  /** Move by CSS pixels. */
  pan(dx, dy) {
    this.setCamera(
      this.camera.x - dx / (this.world.width * this.scale),
      this.camera.y - dy / (this.world.height * this.scale),
      this.camera.zoom,
    );
  }

  /** Zoom by a factor. The point (px, py), by default the center, stays fixed. */
  zoomAt(factor, px = this.width / 2, py = this.height / 2) {
    const before = this.convertToMap(px, py);
    const size = Math.max(this.world.width, this.world.height);
    const maxZoom = MAX_ZOOM * Math.max(1, size / STANDARD_SIZE);
    this.setCamera(this.camera.x, this.camera.y, Math.min(maxZoom, this.camera.zoom * factor));
    const after = this.convertToMap(px, py);
    const x = (before[0] - after[0]) / this.world.width;
    const y = (before[1] - after[1]) / this.world.height;
    this.setCamera(this.camera.x + x, this.camera.y + y, this.camera.zoom);
  }

  setCamera(x, y, zoom) {
    const limited = Math.min(MAX_ADDRESS_ZOOM, Math.max(1, zoom));
    // The complete map stays centered.
    const slack = limited === 1 ? 0 : 0.5;
    const clamp = (value) => Math.min(0.5 + slack, Math.max(0.5 - slack, value));
    this.camera = { x: round(clamp(x)), y: round(clamp(y)), zoom: round(limited) };
    // A finger scrolls the page, unless the map is enlarged.
    this.canvas.style.touchAction = limited === 1 ? "pan-x pan-y" : "none";
  }

  convertToMap(px, py) {
    const [left, top] = this.origin;
    return [(px - left) / this.scale, (py - top) / this.scale];
  }

  /** Return the agent nearest to a position on the canvas, in CSS pixels, or null. */
  findAgent(px, py, reach = 18) {
    const [x, y] = this.convertToMap(px, py);
    let nearest = null;
    let nearestDistance = Math.max(reach / this.scale, 6) ** 2;
    for (let agent = 0; agent < this.count; agent++) {
      const distance = (this.x[agent] - x) ** 2 + (this.y[agent] - y) ** 2;
      // The distance of a dead agent is NaN.
      if (!(distance < nearestDistance)) continue;
      nearest = agent;
      nearestDistance = distance;
    }
    return nearest !== null && this.ids ? this.ids[nearest] : nearest;
  }

  /** Return the position of an agent among the drawn agents, or null. */
  findIndex(agent) {
    const index = this.ids ? this.ids.indexOf(agent) : (agent ?? -1);
    return index < 0 ? null : index;
  }

  /**
   * Set the drawn agents of a world with many agents. null: none.
   * @param {{agent: Uint32Array, x: Float32Array, y: Float32Array,
   *   heading: ArrayLike<number>}|null} agents
   * @param {number} headings of a full turn
   */
  setAgents(agents, headings) {
    this.ids = agents?.agent ?? new Uint32Array(0);
    this.count = this.ids.length;
    this.x = agents?.x;
    this.y = agents?.y;
    const turn = (2 * Math.PI) / headings;
    this.angle = Float32Array.from(agents?.heading ?? [], (heading) => heading * turn);
  }

  /**
   * @param {import("./recording.js").Recording|null} recording null: only the map
   * @param {number} time a step, with a fraction between two steps
   * @param {DrawOptions} [options]
   * @returns {boolean} whether all is drawn; otherwise draw again
   */
  draw(recording, time, options = {}) {
    if (recording) this.setWorld(recording.header);
    let isComplete = true;
    this.drawWorld((transform) => {
      if (recording) isComplete = this.drawRecording(recording, time, options, transform);
    });
    return isComplete;
  }

  /**
   * Draw the map and its content.
   * @param {(transform: number[]) => void} drawContent draws in map units, within the map;
   *   `transform` is the scale and the origin in pixels of the canvas
   */
  drawWorld(drawContent) {
    const { pen, pixelRatio, scale } = this;
    const [left, top] = this.origin;
    const transform = [scale * pixelRatio, left * pixelRatio, top * pixelRatio];
    pen.setTransform(1, 0, 0, 1, 0, 0);
    pen.fillStyle = palette.around;
    pen.fillRect(0, 0, this.canvas.width, this.canvas.height);
    pen.setTransform(transform[0], 0, 0, transform[0], transform[1], transform[2]);
    pen.lineJoin = "round";
    this.drawMap(scale);
    pen.save();
    pen.beginPath();
    pen.rect(0, 0, this.world.width, this.world.height);
    pen.clip();
    drawContent(transform);
    pen.restore();
    this.drawEdge(scale);
  }

  drawRecording(recording, time, options, transform) {
    const { scale } = this;
    const step = Math.min(Math.floor(time), recording.last - 1);
    this.interpolateAgents(recording, step, time - step);
    const isComplete = this.drawTrails(transform, recording, step, options, scale);
    if (options.sight !== false) drawSensors(this, recording, step, options.selectedAgent);
    this.drawItems(
      recording.computeItemPositions(step),
      recording.header.appearance.item_kinds,
      scale,
    );
    drawAgents(this, recording, step, options.selectedAgent);
    return isComplete;
  }

  /** Set the size and the marks of the world. */
  setWorld(header) {
    const { width, height } = header.world;
    this.world = { width, height, marks: header.appearance.marks };
  }

  drawMap(scale) {
    const { pen, world } = this;
    pen.fillStyle = palette.map;
    pen.fillRect(0, 0, world.width, world.height);
    const spacing = Math.min(world.width, world.height) / 8;
    pen.strokeStyle = palette.grid;
    pen.lineWidth = 1 / scale;
    pen.beginPath();
    for (let x = spacing; x < world.width; x += spacing) pen.rect(x, 0, 0, world.height);
    for (let y = spacing; y < world.height; y += spacing) pen.rect(0, y, world.width, 0);
    pen.stroke();
    for (const mark of world.marks) drawMark(pen, mark, scale);
  }

  drawEdge(scale) {
    const { pen, world } = this;
    pen.strokeStyle = palette.edge;
    pen.lineWidth = 1.5 / scale;
    pen.strokeRect(0, 0, world.width, world.height);
  }

  /** Interpolate the position of every agent between two steps. */
  interpolateAgents(
    { agents, first, last, header: { appearance }, arrays: { x, y, heading } },
    step,
    share,
  ) {
    if (this.ids || this.count !== agents) {
      this.ids = null;
      this.count = agents;
      for (const name of ["x", "y", "angle"]) this[name] = new Float32Array(agents);
    }
    const { width, height } = this.world;
    const turn = (2 * Math.PI) / appearance.headings;
    const index = (step - first) * agents;
    const nextRow = step + 1 < last ? index + agents : index;
    for (let agent = 0; agent < agents; agent++) {
      const current = index + agent;
      const next = nextRow + agent;
      this.x[agent] = interpolate(x[current], x[next], share, width);
      this.y[agent] = interpolate(y[current], y[next], share, height);
      this.angle[agent] = interpolate(heading[current], heading[next], share, appearance.headings) *
        turn;
    }
  }

  drawTrails(transform, recording, step, options, scale) {
    const { trails = "recent", selectedAgent } = options;
    const width = Math.max(1.1 / scale, 0.9);
    // Blue is the color of a species.
    const color = recording.header.species ? palette.outline : palette.trail;
    let isComplete = true;
    if (trails === "life")
      isComplete = this.life.draw(
        this.pen,
        this.canvas,
        transform,
        recording,
        step,
        color,
        width,
      );
    else if (trails === "recent") drawRecentTrails(this.pen, recording, step, color, width);
    if (trails !== "off" && selectedAgent != null && selectedAgent < this.count)
      drawAgentTrail(this.pen, recording, step, selectedAgent, palette.chosen, width * 1.3);
    return isComplete;
  }

  /** Draw items. They are numbered by kind. */
  drawItems(positions, kinds, scale) {
    const { pen } = this;
    const radius = Math.max(3.4, 2.2 / scale);
    let item = 0;
    for (const { color, number } of kinds) {
      pen.fillStyle = resolveColor(color);
      for (const end = item + number; item < end; item++) {
        // One path per item takes half the time of one path for all.
        pen.beginPath();
        pen.arc(positions.x[item], positions.y[item], radius, 0, 2 * Math.PI);
        pen.fill();
      }
    }
  }
}

/** Draw a mark: solid objects are filled, areas are tinted or dashed. */
function drawMark(pen, { kind, x, y, width, height, color, solid }, scale) {
  pen.beginPath();
  if (kind === "disc")
    pen.ellipse(x + width / 2, y + height / 2, width / 2, height / 2, 0, 0, 2 * Math.PI);
  else pen.rect(x, y, width, height);
  pen.fillStyle = pen.strokeStyle = resolveColor(color);
  pen.lineWidth = 1 / scale;
  if (solid) pen.fill();
  else if (kind === "disc") {
    pen.globalAlpha = 0.6;
    pen.setLineDash([4 / scale, 4 / scale]);
    pen.stroke();
    pen.setLineDash([]);
  } else {
    pen.globalAlpha = 0.07;
    pen.fill();
    pen.globalAlpha = 0.35;
    pen.stroke();
  }
  pen.globalAlpha = 1;
}

/** Round to the precision of the address. */
function round(value) {
  return Math.round(value * 1e7) / 1e7;
}

/** Interpolate between two numbers along the shorter way on a circle. */
function interpolate(from, to, share, size) {
  const value = from + shortestDistance(to - from, size) * share;
  if (value < 0) return value + size;
  return value >= size ? value - size : value;
}
