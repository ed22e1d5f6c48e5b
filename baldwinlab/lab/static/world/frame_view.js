/** Draw the frames of a world with many agents: density, or single agents when few are visible. */

import { drawAgents } from "./agents.js";
import { formatNumber } from "../core/common.js";
import { DensityLayer, DensityLegend, SQUARE_SIZE } from "./density.js";

// CSS pixels of the map per agent, and per item. With less, squares are drawn.
const PIXELS_PER_SHAPE = 100;
// Drawing more shapes would take longer than a frame.
const MAX_SHAPES = 2000;
// Milliseconds without a frame, after which the page shows the progress of the simulation.
const WAITING_TIME = 400;

/** The view of a frame stream in a world view. */
export class FrameView {
  /**
   * @param {import("./world_view.js").WorldView} view
   * @param {() => void} changed called when the user hides or shows a layer
   */
  constructor(view, changed) {
    this.view = view;
    this.density = new DensityLayer();
    this.legend = new DensityLegend(() => {
      this.drawn = [];
      changed();
    });
    // The values that determine the picture.
    this.drawn = [];
    this.lastLoaded = performance.now();
  }

  /**
   * Draw a moment of a stream, unless it is already on the canvas.
   * @param {import("./frame_stream.js").FrameStream} stream
   * @param {number} time in steps
   * @param {{selectedAgent: number|null, pace: number}} options `pace` in steps per second
   * @returns {{isLoaded: boolean, ready: boolean, isWaiting: boolean, text: string}} whether the
   *   moment is loaded, whether it is completely drawn, whether the simulation is far behind, and
   *   the text about the moment
   */
  draw(stream, time, { selectedAgent, pace }) {
    const { view } = this;
    view.setWorld(stream.header);
    const { frame, isLoaded } = stream.findFrame(time, computeWindow(view), pace);
    const { x, y, zoom } = view.camera;
    const isDark = matchMedia("(prefers-color-scheme: dark)").matches;
    const values = [frame, selectedAgent, x, y, zoom, isDark, view.resizes];
    if (values.some((value, number) => value !== this.drawn[number])) {
      this.drawn = values;
      this.legend.show(stream.header, frame);
      view.drawWorld(() => frame && this.drawFrame(frame, selectedAgent));
      // The step on the canvas, for tests and benchmarks.
      if (frame) view.canvas.dataset.step = String(frame.step);
    }
    const now = performance.now();
    if (isLoaded) this.lastLoaded = now;
    const isWaiting = now - this.lastLoaded > WAITING_TIME;
    const text = isWaiting ? describeProgress(stream, time) : describeFrame(stream, frame, pace);
    return { isLoaded, ready: true, isWaiting, text };
  }

  drawFrame(frame, selectedAgent) {
    const { view, legend } = this;
    const { agents, items, window } = frame;
    const kinds = frame.header.appearance.item_kinds;
    const squares = window.columns * window.rows;
    const densities = items.counts
      ? kinds.map(({ color }, kind) => ({
        color,
        counts: items.counts.subarray(kind * squares, (kind + 1) * squares),
      }))
      : [];
    this.density.draw(
      view.pen,
      window,
      legend.showsAgents ? (agents.counts ?? null) : null,
      legend.showsItems ? densities : [],
    );
    if (items.numbers && legend.showsItems)
      view.drawItems(
        items,
        kinds.map((kind, number) => ({ ...kind, number: items.numbers[number] })),
        view.scale,
      );
    view.setAgents(frame.showsAgents ? agents : null, frame.header.appearance.headings);
    if (frame.showsAgents && legend.showsAgents)
      drawAgents(view, frame, frame.step, view.findIndex(selectedAgent));
  }
}

function describeProgress({ stepsSimulated }, time) {
  const step = formatNumber(Math.floor(time));
  return `Simulating: ${formatNumber(stepsSimulated)} steps done, up to step ${step} …`;
}

/** Return the eaten items, and the rate of simulation if it limits playback. */
function describeFrame(stream, frame, pace) {
  const eaten = frame?.describeEaten() ?? "";
  if (pace <= stream.maxPace) return eaten;
  return `${eaten} · simulates ${formatNumber(stream.rate)} steps per second`;
}

/** Return the visible part of the map, in whole squares that do not move with the camera. */
function computeWindow(view) {
  const { scale, world } = view;
  const size = SQUARE_SIZE / scale;
  const [left, top] = view.convertToMap(0, 0);
  const [right, bottom] = view.convertToMap(view.width, view.height);
  const firstColumn = Math.floor(Math.max(0, left) / size);
  const firstRow = Math.floor(Math.max(0, top) / size);
  const columns = Math.max(1, Math.ceil(Math.min(world.width, right) / size) - firstColumn);
  const rows = Math.max(1, Math.ceil(Math.min(world.height, bottom) / size) - firstRow);
  const pixels = columns * rows * SQUARE_SIZE ** 2;
  return {
    left: firstColumn * size,
    top: firstRow * size,
    right: (firstColumn + columns) * size,
    bottom: (firstRow + rows) * size,
    columns,
    rows,
    max_shapes: Math.min(MAX_SHAPES, Math.max(1, Math.floor(pixels / PIXELS_PER_SHAPE))),
  };
}
