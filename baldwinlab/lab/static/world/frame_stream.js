/** The lifetime of a world with many agents, which arrives frame by frame. Needs no page. */

import { formatEaten } from "./recording.js";

/**
 * @typedef {object} Window a part of the map, in map units, divided into squares
 * @property {number} left
 * @property {number} top
 * @property {number} right
 * @property {number} bottom
 * @property {number} columns
 * @property {number} rows
 * @property {number} max_shapes the most agents, and the most items, that are drawn one by one
 */

/** The world before a step. It has the methods of a recording that the drawing of agents needs. */
export class Frame {
  /**
   * @param {Object<string, any>} header of /api/frames
   * @param {number} step
   * @param {{items: number, eaters: number}} eaten before the step
   * @param {Object<string, ArrayLike<number>>} agents the counts, or one entry per visible agent
   * @param {Object<string, ArrayLike<number>>} items as `agents`
   */
  constructor(header, step, eaten, agents, items) {
    this.header = header;
    this.step = step;
    this.eaten = eaten;
    this.agents = agents;
    this.items = items;
    this.first = 0;
    this.interval = header.interval;
    this.window = header.window;
  }

  /** Whether agents are drawn one by one. */
  get showsAgents() {
    return !this.agents.counts;
  }

  /** Return whether a step is nearer to this frame than to the next one. */
  covers(step) {
    return step >= this.step && step < this.step + this.interval;
  }

  /** Return the text about the eaten items. */
  describeEaten() {
    return formatEaten(this.eaten, this.header.agents);
  }

  /** Return the number of items that a visible agent has eaten. */
  countEaten(_step, index) {
    return this.agents.agent_eaten[index];
  }

  /** Return the species of a visible agent, or null without species. */
  findSpecies(index) {
    return this.header.species?.[this.agents.species[index]] ?? null;
  }

  /** Return null, because frames contain no teachers. */
  findTeacher() {
    return null;
  }
}

/**
 * Return the frames of a container.
 * @param {{header: Object<string, any>, arrays: Object<string, any>}} container of /api/frames
 * @returns {Frame[]}
 */
function readFrames({ header, arrays }) {
  const squares = header.window.columns * header.window.rows;
  const kinds = header.appearance.item_kinds.length;
  // The number of agents and of items in earlier frames.
  let [agentStart, itemStart] = [0, 0];
  return header.frames.map((step, number) => {
    const eaten = { items: arrays.eaten[number], eaters: arrays.eaters[number] };
    /** @type {Object<string, any>} */
    const agents = {};
    if (arrays.agent_counts)
      agents.counts = arrays.agent_counts.subarray(number * squares, (number + 1) * squares);
    else {
      const stop = agentStart + arrays.agent_number[number];
      for (const name of ["agent", "x", "y", "heading", "agent_eaten", "species"])
        agents[name] = arrays[name]?.subarray(agentStart, stop);
      agentStart = stop;
    }
    /** @type {Object<string, any>} */
    const items = {};
    if (arrays.item_counts) {
      const size = kinds * squares;
      items.counts = arrays.item_counts.subarray(number * size, (number + 1) * size);
    } else {
      items.numbers = arrays.item_number.subarray(number * kinds, (number + 1) * kinds);
      const stop = itemStart + items.numbers.reduce((sum, size) => sum + size, 0);
      items.x = arrays.item_x.subarray(itemStart, stop);
      items.y = arrays.item_y.subarray(itemStart, stop);
      itemStart = stop;
    }
    return new Frame(header, step, eaten, agents, items);
  });
}

// Frames per second of playback. More steps per second need more steps per frame.
const FRAME_RATE = 20;
// Seconds of playback that are loaded in advance.
const LOOKAHEAD = 0.4;
// Frames that are requested in advance. A frame that the page waits for is requested alone.
const FRAMES_PER_REQUEST = 8;
// Weight of the newest measurement in the rate of simulation.
const RATE_WEIGHT = 0.3;
// Playback is slower than the simulation by this factor, so that frames arrive in time.
const PACE_MARGIN = 0.95;
const WINDOW_KEYS = ["left", "top", "right", "bottom", "columns", "rows", "max_shapes"];

/** A lifetime with the interface of `Lifetime`, but with frames instead of recordings. */
export class FrameStream {
  /**
   * @param {(query: Object<string, number>, signal: AbortSignal) => Promise<any>} fetchFrames
   *   requests /api/frames
   * @param {() => void} changed called when frames are loaded
   * @param {(fault: Error) => void} failed called after an error
   */
  constructor(fetchFrames, changed, failed) {
    this.fetchFrames = fetchFrames;
    this.changed = changed;
    this.failed = failed;
    // A stream has no recordings, so the timeline marks no meals.
    this.parts = new Map();
    this.isStream = true;
    this.header = null;
    /** @type {Frame[]} in the order of their steps */
    this.frames = [];
    // Simulated steps per second, or 0 until it is measured.
    this.rate = 0;
    this.stepsSimulated = 0;
    this.isLoading = false;
    this.stop = new AbortController();
    // The first request only describes the world.
    this.load({ count: 0 });
  }

  /** Whether the world is described. */
  get isLoaded() {
    return this.header !== null;
  }

  get steps() {
    return this.header?.steps ?? 0;
  }

  /** Steps per second that the simulation can provide. */
  get maxPace() {
    return this.rate ? this.rate * PACE_MARGIN : Infinity;
  }

  describeAgent(agent) {
    return `agent ${agent}`;
  }

  /** Return null, because a stream has no recordings. */
  findPart() {
    return null;
  }

  /** Return null, because frames contain no meals. */
  findMeal() {
    return null;
  }

  /**
   * Return the frame of a time, or the last one before it, and whether the time is loaded.
   * @param {number} time in steps
   * @param {Window} window
   * @param {number} pace steps per second of playback
   * @returns {{frame: Frame|null, isLoaded: boolean}}
   */
  findFrame(time, window, pace) {
    const step = Math.floor(time);
    const index = this.frames.findLastIndex((frame) => frame.step <= step);
    const frame = this.frames[index] ?? this.frames[0] ?? null;
    const isLoaded = frame?.covers(step) ?? false;
    const isCurrent = isLoaded && isSameWindow(frame.window, window);
    // Earlier frames are not needed.
    if (index > 0) this.frames.splice(0, index);
    this.prefetch(isLoaded ? frame : null, isCurrent, step, window, pace);
    return { frame, isLoaded };
  }

  /** Request the frame of a step, its picture in a new window, or later frames. */
  prefetch(frame, isCurrent, step, window, pace) {
    if (!this.isLoaded || this.isLoading || this.hasFailed) return;
    const playbackRate = Math.min(pace, this.maxPace);
    // Until the rate is known, each step has a frame.
    const interval = this.rate ? Math.max(1, Math.round(playbackRate / FRAME_RATE)) : 1;
    let first = frame?.step ?? step;
    if (isCurrent) {
      const last = this.frames.at(-1);
      first = last.step + last.interval;
      const isFarAhead = first - step > Math.max(interval, playbackRate * LOOKAHEAD);
      if (first >= this.steps || isFarAhead) return;
    }
    const count = isCurrent ? FRAMES_PER_REQUEST : 1;
    this.load({ first, interval, count, ...window });
  }

  async load(query) {
    this.isLoading = true;
    const start = performance.now();
    try {
      const container = await this.fetchFrames(query, this.stop.signal);
      const { header } = container;
      this.header ??= header;
      this.measureRate(header.simulated, performance.now() - start);
      if (header.frames.length) this.add(readFrames(container));
    } catch (error) {
      if (error.name === "AbortError") return;
      this.hasFailed = true;
      this.failed(error);
    } finally {
      this.isLoading = false;
    }
    this.changed();
  }

  /** Replace the frames from the first of the new ones. */
  add(frames) {
    const earlier = this.frames.filter(({ step }) => step < frames[0].step);
    this.frames = [...earlier, ...frames];
  }

  measureRate(stepsSimulated, milliseconds) {
    const before = this.stepsSimulated;
    const steps = stepsSimulated - before;
    this.stepsSimulated = stepsSimulated;
    // The first response prepares the world. Later, the simulation can begin again, and frames can
    // be stored.
    if (before === 0 || steps <= 0) return;
    const rate = (1000 * steps) / milliseconds;
    this.rate += (this.rate ? RATE_WEIGHT : 1) * (rate - this.rate);
  }

  /** Cancel the request and drop all frames. */
  close() {
    this.stop.abort();
    this.frames = [];
  }
}

function isSameWindow(first, second) {
  return WINDOW_KEYS.every((key) => Math.abs(first[key] - second[key]) < 1e-6);
}
