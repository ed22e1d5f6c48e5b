/** The recording of a lifetime, and a lifetime that loads its parts. */

import { formatNumber } from "../core/common.js";

// Item moves between two stored states of all items.
const KEYFRAME_INTERVAL = 256;
// Maximum number of loaded parts of a long lifetime.
const MAX_PARTS = 4;

/** The steps from `first` up to, but not including, `last`: the container of /api/recording. */
export class Recording {
  /** @param {{header: Object<string, any>, arrays: Object<string, any>}} container */
  constructor({ header, arrays }) {
    this.header = header;
    this.arrays = arrays;
    this.first = header.first;
    this.last = header.last;
    this.steps = header.steps;
    this.agents = header.agents;
    this.items = header.items;
    const { inputs, sectors, is_continuous: isContinuous } = header.appearance;
    this.inputs = inputs.map((name, input) => ({
      name,
      sector: sectors[input],
      isContinuous: isContinuous[input],
    }));
    // Whether inputs are float32 numbers instead of bits.
    this.hasNumbers = isContinuous.some(Boolean);
    this.inputBytes = Math.ceil(this.inputs.length / 8);
    this.positions = { x: arrays.item_x.slice(), y: arrays.item_y.slice() };
    // Number of moves that `positions` contains.
    this.movesApplied = 0;
    this.keyframes = [{ x: arrays.item_x, y: arrays.item_y }];
    this.meals = countMeals(this);
  }

  /** Return the positions of items at a step, {x, y}. The arrays are reused by the next call. */
  computeItemPositions(step) {
    const moveCount = countMovesUntil(this.arrays.move_step, step);
    const keyframe = Math.min(Math.floor(moveCount / KEYFRAME_INTERVAL), this.keyframes.length - 1);
    if (moveCount < this.movesApplied || this.movesApplied < keyframe * KEYFRAME_INTERVAL) {
      this.positions.x.set(this.keyframes[keyframe].x);
      this.positions.y.set(this.keyframes[keyframe].y);
      this.movesApplied = keyframe * KEYFRAME_INTERVAL;
    }
    const { move_item, move_x, move_y } = this.arrays;
    while (this.movesApplied < moveCount) {
      this.positions.x[move_item[this.movesApplied]] = move_x[this.movesApplied];
      this.positions.y[move_item[this.movesApplied]] = move_y[this.movesApplied];
      this.movesApplied += 1;
      if (this.movesApplied === this.keyframes.length * KEYFRAME_INTERVAL) {
        this.keyframes.push({ x: this.positions.x.slice(), y: this.positions.y.slice() });
      }
    }
    return this.positions;
  }

  /**
   * Return an input of an agent at a step: 0 or 1, or a number between them if it is real-valued.
   */
  readInput(step, agent, input) {
    const row = (step - this.first) * this.agents + agent;
    if (this.hasNumbers) return this.arrays.sensor[row * this.inputs.length + input];
    return (this.arrays.sensor[row * this.inputBytes + (input >> 3)] >> (input & 7)) & 1;
  }

  /**
   * Return the names of the active inputs of an agent at a step, with values if they are
   * real-valued.
   */
  listActiveInputs(step, agent) {
    return this.inputs.flatMap(({ name, isContinuous }, input) => {
      const value = this.readInput(step, agent, input);
      if (!(value > 0)) return [];
      return isContinuous ? `${name} ${formatNumber(value)}` : name;
    });
  }

  /**
   * Return the species of an agent, or null without species.
   * @returns {{name: string, color: string, shape: string, inputs: number[],
   *   actions: string[]}|null}
   */
  findSpecies(agent) {
    return this.header.species?.[this.arrays.species[agent]] ?? null;
  }

  /** Return whether an agent has an input. Species can have different inputs. */
  hasInput(agent, input) {
    return this.findSpecies(agent)?.inputs.includes(input) ?? true;
  }

  /** Return the name of the action of an agent in a step. */
  findAction(step, agent) {
    const { actions } = this.findSpecies(agent) ?? this.header.appearance;
    return actions[this.arrays.action[(step - this.first) * this.agents + agent]];
  }

  /** Return a text such as: agent 3, prey. */
  describeAgent(agent) {
    const species = this.findSpecies(agent);
    return species ? `agent ${agent}, ${species.name}` : `agent ${agent}`;
  }

  /** Return the agent that another agent learns from in a step, or null. */
  findTeacher(step, agent) {
    const teacher = this.arrays.teacher?.[(step - this.first) * this.agents + agent] ?? agent;
    return teacher === agent ? null : teacher;
  }

  /** Return whether an agent eats in a step, or any agent if it is null. */
  hasMeal(step, agent) {
    if (agent === null) return this.meals[step - this.first] > 0;
    return step > this.first && this.countEaten(step + 1, agent) > this.countEaten(step, agent);
  }

  /** Return the number of items that an agent has eaten before a step. */
  countEaten(step, agent) {
    const row = Math.min(step, this.last) - this.first - 1;
    return row < 0 ? 0 : this.arrays.eaten_in_life[row * this.agents + agent];
  }

  /** Return the number of items that all agents have eaten before a step, and of their eaters. */
  countAllEaten(step) {
    let items = 0;
    let eaters = 0;
    for (let agent = 0; agent < this.agents; agent++) {
      const eaten = this.countEaten(step, agent);
      items += eaten;
      if (eaten) eaters += 1;
    }
    return { items, eaters };
  }

  /** Return the text about items eaten before a step, and the number of agents that ate. */
  describeEaten(step) {
    return formatEaten(this.countAllEaten(step), this.agents);
  }

  /** Return a text such as: agent 3, 12 items eaten. */
  describeEater(step, agent) {
    const eaten = this.countEaten(step, agent);
    const items = eaten === 1 ? "1 item" : `${formatNumber(eaten)} items`;
    return `${this.describeAgent(agent)}, ${items} eaten`;
  }
}

/** Return a text such as: 12 eaten · 5 of 20 ate. */
export function formatEaten({ items, eaters }, agents) {
  return `${formatNumber(items)} eaten · ${formatNumber(eaters)} of ${formatNumber(agents)} ate`;
}

/**
 * Return the lifetime of one recording, which contains all steps or the first ones.
 * @returns {Life}
 */
export function createLifetime(recording) {
  const { header, steps } = recording;
  return {
    header,
    steps,
    parts: new Map([[0, recording]]),
    isStream: false,
    maxPace: Infinity,
    findPart: () => recording,
    close() {},
  };
}

/** Return the number of moves at or before a step. `move_step` is sorted. */
function countMovesUntil(moveStep, step) {
  let low = 0;
  let high = moveStep.length;
  while (low < high) {
    const middle = (low + high) >> 1;
    if (moveStep[middle] <= step) low = middle + 1;
    else high = middle;
  }
  return low;
}

/** Return the number of items that all agents eat in each step. */
function countMeals(/** @type {Recording} */ { agents, first, arrays: { eaten_in_life: eaten } }) {
  const meals = new Uint16Array(eaten.length / agents);
  let previous = null;
  for (let row = 0; row < meals.length; row++) {
    let sum = 0;
    for (let index = row * agents; index < (row + 1) * agents; index++) sum += eaten[index];
    // The items eaten before the first step of a part are unknown.
    meals[row] = sum - (previous ?? (first ? sum : 0));
    previous = sum;
  }
  return meals;
}

/**
 * @typedef {object} Life a lifetime that a world shows: recordings, or a stream of frames
 * @property {Object<string, any>} header
 * @property {number} steps
 * @property {Map<number, Recording>} parts the loaded recordings
 * @property {boolean} isStream whether it has frames instead of recordings
 * @property {number} maxPace steps per second that can be provided
 * @property {(step: number) => Recording|null} findPart returns the recording of a step, or null
 *   while it loads
 * @property {(step: number, direction: number, agent: number|null) => number|null} [findMeal]
 *   returns the nearest step with a meal, or null
 * @property {() => void} close cancels all requests
 */

/** A complete lifetime, in one part or in parts that are loaded when needed. */
export class Lifetime {
  /**
   * @param {(part: {first: number, last: number}|null, signal: AbortSignal) => Promise<Recording>}
   *   fetchPart null: as much as one response contains
   * @param {() => void} changed called when a part is loaded
   * @param {(fault: Error) => void} failed called after an error
   */
  constructor(fetchPart, changed, failed) {
    this.fetchPart = fetchPart;
    this.changed = changed;
    this.failed = failed;
    // By number. The most recently used part is the last.
    this.parts = new Map();
    // Steps of a part, or 0 until the first part is loaded.
    this.length = 0;
    this.loadingPart = null;
    this.isStream = false;
    this.maxPace = Infinity;
    this.stop = new AbortController();
    this.loadPart(0);
  }

  /** Whether the first part is loaded. */
  get isLoaded() {
    return this.length > 0;
  }

  /**
   * Return the part that contains a step, or null while it loads. The next part is loaded in
   * advance.
   */
  findPart(step) {
    if (!this.length) return null;
    const number = Math.floor(step / this.length);
    const part = this.parts.get(number);
    if (!part) {
      this.loadPart(number);
      return null;
    }
    if (this.parts.size > 1) {
      this.parts.delete(number);
      this.parts.set(number, part);
    }
    if (part.last < part.steps && step - part.first > this.length / 2) this.loadPart(number + 1);
    return part;
  }

  /**
   * Return the nearest step with a meal after (`direction` 1) or before (-1) a step, or null.
   *
   * If the agent is null, a meal of any agent counts. Only loaded parts are searched.
   */
  findMeal(step, direction, agent) {
    for (let index = step + direction; index >= 0 && index < this.steps; index += direction) {
      const part = this.parts.get(Math.floor(index / this.length));
      if (!part) return null;
      if (part.hasMeal(index, agent)) return index;
    }
    return null;
  }

  async loadPart(number) {
    if (this.loadingPart !== null || this.parts.has(number) || this.failedOnce) return;
    this.loadingPart = number;
    try {
      const first = number * this.length;
      const part = this.length ? { first, last: Math.min(first + this.length, this.steps) } : null;
      const recording = await this.fetchPart(part, this.stop.signal);
      this.length ||= recording.last - recording.first;
      this.steps = recording.steps;
      this.header = recording.header;
      this.parts.set(number, recording);
      if (this.parts.size > MAX_PARTS) this.parts.delete(this.parts.keys().next().value);
    } catch (error) {
      if (error.name === "AbortError") return;
      this.failedOnce = true;
      this.failed(error);
    } finally {
      this.loadingPart = null;
    }
    this.changed();
  }

  /** Cancel all requests and drop all parts. */
  close() {
    this.stop.abort();
    this.parts.clear();
  }
}
