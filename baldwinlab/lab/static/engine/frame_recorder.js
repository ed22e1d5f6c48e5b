/** Frames of a world with many agents in the browser, as lab/sources/frames.py. Needs no page. */

import { concatenate } from "./simulation.js";

// Milliseconds of simulation before a response.
const RESPONSE_TIME = 100;
// Bytes of the stored snapshots.
const MAX_SNAPSHOT_BYTES = 64_000_000;
// Agent-steps between two checks of the time.
const PIECE_AGENT_STEPS = 1_000_000;

/** One lifetime, simulated up to a step, and its latest snapshots: see lab/sources/frames.py. */
export class WorldCursor {
  /** @param {import("./simulation.js").Run} run prepared, with the genomes of the generation */
  constructor(run, generation) {
    this.run = run;
    this.generation = generation;
    this.snapshots = new Map();
    const { lifetime, population } = run.experiment;
    this.steps = lifetime.steps;
    this.agents = population.size;
    this.pieceSteps = Math.max(1, Math.floor(PIECE_AGENT_STEPS / this.agents));
    // Before the lifetime begins.
    this.stepsDone = Infinity;
  }

  /**
   * Return the steps and the arrays of the requested frames, as many as a limited time allows.
   * @param {{first: number, interval: number, count: number, window:
   *   import("../world/frame_stream.js").Window}} query
   * @param {number[]} kindSizes the number of items of each kind
   */
  makeFrames({ first, interval, count, window }, kindSizes) {
    const deadline = performance.now() + RESPONSE_TIME;
    const frames = [];
    const worlds = [];
    for (let number = 0; number < count; number++) {
      const step = first + number * interval;
      const isInTime = number === 0 || performance.now() < deadline;
      if (step >= this.steps || !isInTime || !this.simulateUntil(step, deadline)) break;
      frames.push(step);
      worlds.push(this.snapshots.get(step));
    }
    const arrays = {
      eaten: Uint32Array.from(worlds, ({ eaten }) => sum(eaten)),
      eaters: Uint32Array.from(worlds, ({ eaten }) => eaten.filter((items) => items).length),
    };
    if (worlds.length)
      Object.assign(
        arrays,
        collectAgents(worlds, window),
        collectItems(worlds, window, kindSizes),
      );
    return { frames, simulated: Number.isFinite(this.stepsDone) ? this.stepsDone : 0, arrays };
  }

  /** Return whether the snapshot of a step is stored. The simulation stops at the deadline. */
  simulateUntil(step, deadline) {
    if (this.snapshots.has(step)) return true;
    if (step < this.stepsDone) {
      this.run.startGeneration(this.generation);
      this.stepsDone = 0;
    }
    while (this.stepsDone < step) {
      const stop = Math.min(this.stepsDone + this.pieceSteps, step);
      this.run.simulateSteps(this.stepsDone, stop);
      this.stepsDone = stop;
      if (performance.now() > deadline && stop < step) return false;
    }
    this.store(step, takeSnapshot(this.run.engine, this.agents));
    return true;
  }

  /** Store a snapshot, and drop the oldest ones if they need too much memory. */
  store(step, snapshot) {
    this.snapshots.set(step, snapshot);
    const bytes = sum(Object.values(snapshot).map(({ byteLength }) => byteLength));
    const maxSnapshots = Math.max(1, Math.floor(MAX_SNAPSHOT_BYTES / bytes));
    for (const oldest of this.snapshots.keys()) {
      if (this.snapshots.size <= maxSnapshots) break;
      this.snapshots.delete(oldest);
    }
  }
}

/** Return copies of the agents and the items. `x` of a dead agent is negative. */
function takeSnapshot(engine, agents) {
  const positions = engine.array("state.positions");
  const heading = engine.array("state.heading");
  const eatenByRegion = engine.array("state.eaten_in_life");
  const lanes = heading.length;
  const eaten = new Uint32Array(agents);
  for (let start = 0; start < eatenByRegion.length; start += lanes) {
    for (let agent = 0; agent < agents; agent++) eaten[agent] += eatenByRegion[start + agent];
  }
  return {
    x: positions.slice(0, agents),
    y: positions.slice(lanes, lanes + agents),
    heading: heading.slice(0, agents),
    eaten,
    item_x: engine.array("state.item_x").slice(),
    item_y: engine.array("state.item_y").slice(),
  };
}

/** Return the counts of agents, or the visible agents if there are few. */
function collectAgents(worlds, window) {
  const visible = worlds.map(({ x, y }) => findVisible(window, x, y));
  if (visible[0].length > window.max_shapes)
    return { agent_counts: concatenate(worlds.map(({ x, y }) => countBySquare(window, x, y))) };
  const select = (name) =>
    concatenate(worlds.map((world, number) => take(world[name], visible[number])));
  return {
    agent_number: Uint32Array.from(visible, (agents) => agents.length),
    agent: concatenate(visible),
    x: select("x"),
    y: select("y"),
    heading: select("heading"),
    agent_eaten: select("eaten"),
  };
}

/** Return the counts of items, or the visible items if there are few. Kind follows kind. */
function collectItems(worlds, window, kindSizes) {
  const ranges = kindSizes.map((size, kind) => {
    const start = sum(kindSizes.slice(0, kind));
    return [start, start + size];
  });
  const visible = worlds.map((world) => findVisible(window, world.item_x, world.item_y));
  if (visible[0].length > window.max_shapes) {
    const countKinds = ({ item_x: x, item_y: y }) =>
      ranges.map(([start, end]) =>
        countBySquare(window, x.subarray(start, end), y.subarray(start, end))
      );
    return { item_counts: concatenate(worlds.flatMap(countKinds)) };
  }
  const countVisible = (items) =>
    ranges.map(([start, end]) => items.filter((item) => item >= start && item < end).length);
  const select = (name) =>
    concatenate(worlds.map((world, number) => take(world[name], visible[number])));
  return {
    item_number: Uint32Array.from(visible.flatMap(countVisible)),
    item_x: select("item_x"),
    item_y: select("item_y"),
  };
}

/** Return the indices of the positions in a window. */
function findVisible({ left, top, right, bottom }, x, y) {
  const indices = new Uint32Array(x.length);
  let size = 0;
  for (let index = 0; index < x.length; index++)
    if (x[index] >= left && x[index] < right && y[index] >= top && y[index] < bottom)
      indices[size++] = index;
  return indices.slice(0, size);
}

/** Return the number of positions in each square of a window, row by row. */
function countBySquare({ left, top, right, bottom, columns, rows }, x, y) {
  const counts = new Uint32Array(columns * rows);
  // The server computes with float32 numbers.
  const [x0, y0] = [Math.fround(left), Math.fround(top)];
  const xScale = Math.fround(columns / (right - left));
  const yScale = Math.fround(rows / (bottom - top));
  for (let index = 0; index < x.length; index++) {
    const column = Math.floor(Math.fround(Math.fround(x[index] - x0) * xScale));
    const row = Math.floor(Math.fround(Math.fround(y[index] - y0) * yScale));
    if (column >= 0 && column < columns && row >= 0 && row < rows)
      counts[row * columns + column] += 1;
  }
  return counts;
}

/** Return the entries of a typed array at some indices. */
function take(values, indices) {
  const selected = new values.constructor(indices.length);
  indices.forEach((index, number) => (selected[number] = values[index]));
  return selected;
}

function sum(numbers) {
  return numbers.reduce((total, number) => total + number, 0);
}
