/** A lifetime as it was recorded, and where its parts come from. Needs no page. */

const KEYFRAME_EVERY = 256; // moves of items between two kept positions of all items
const MAX_PARTS = 4; // parts of a long life held at once

/** Steps `first` up to, and without, `last` of a lifetime: the container of /api/recording. */
export class Recording {
  /** @param {{header: Object<string, any>, arrays: Object<string, ArrayLike<number>>}} container */
  constructor({ header, arrays }) {
    this.header = header;
    this.arrays = arrays;
    ({
      first: this.first,
      last: this.last,
      steps: this.steps,
      agents: this.agents,
      items: this.items,
    } = header);
    const { inputs, sectors, real } = header.look;
    this.inputs = inputs.map((name, input) => ({
      name,
      sector: sectors[input],
      real: real[input],
    }));
    this.numbers = real.some(Boolean); // float32 inputs, and not bits
    this.inputBytes = Math.ceil(this.inputs.length / 8);
    this.positions = { x: arrays.item_x.slice(), y: arrays.item_y.slice() };
    this.movesApplied = 0; // moves that `positions` has made
    this.keyframes = [{ x: arrays.item_x, y: arrays.item_y }];
    this.meals = mealsOf(this);
  }

  /** Where the items lie at a step, {x, y}; the same two arrays are filled at every call. */
  itemsAt(step) {
    const moveCount = countMovesUntil(this.arrays.move_step, step);
    const keyframe = Math.min(Math.floor(moveCount / KEYFRAME_EVERY), this.keyframes.length - 1);
    if (moveCount < this.movesApplied || this.movesApplied < keyframe * KEYFRAME_EVERY) {
      this.positions.x.set(this.keyframes[keyframe].x);
      this.positions.y.set(this.keyframes[keyframe].y);
      this.movesApplied = keyframe * KEYFRAME_EVERY;
    }
    const { move_item, move_x, move_y } = this.arrays;
    while (this.movesApplied < moveCount) {
      this.positions.x[move_item[this.movesApplied]] = move_x[this.movesApplied];
      this.positions.y[move_item[this.movesApplied]] = move_y[this.movesApplied];
      this.movesApplied += 1;
      if (this.movesApplied === this.keyframes.length * KEYFRAME_EVERY) {
        this.keyframes.push({ x: this.positions.x.slice(), y: this.positions.y.slice() });
      }
    }
    return this.positions;
  }

  /** What an input of an agent is at a step: 0 or 1, or between them where it is real-valued. */
  sensed(step, agent, input) {
    const row = (step - this.first) * this.agents + agent;
    if (this.numbers) return this.arrays.sensor[row * this.inputs.length + input];
    return (this.arrays.sensor[row * this.inputBytes + (input >> 3)] >> (input & 7)) & 1;
  }

  /** The inputs of an agent that are above 0 at a step, in words; with its value where one is real-valued. */
  senses(step, agent) {
    const values = this.inputs.map(({ name, real }, input) => ({
      name,
      real,
      value: this.sensed(step, agent, input),
    }));
    return values
      .filter(({ value }) => value > 0)
      .map(({ name, real, value }) => (real ? `${name} ${value.toFixed(2)}` : name));
  }

  /** The agent from whom another learns in a step, or null. */
  learnsFrom(step, agent) {
    const teacher = this.arrays.teacher?.[(step - this.first) * this.agents + agent] ?? agent;
    return teacher === agent ? null : teacher;
  }

  /** Whether an agent, or null: any of them, eats in a step. */
  eats(step, agent) {
    if (agent === null) return this.meals[step - this.first] > 0;
    return step > this.first && this.eatenBefore(step + 1, agent) > this.eatenBefore(step, agent);
  }

  /** Items that an agent has eaten before a step. */
  eatenBefore(step, agent) {
    const row = Math.min(step, this.last) - this.first - 1;
    return row < 0 ? 0 : this.arrays.eaten_in_life[row * this.agents + agent];
  }

  /** What was eaten before a step, in words: items, and agents that ate. */
  eaten(step) {
    let [items, eaters] = [0, 0];
    for (let agent = 0; agent < this.agents; agent++) {
      const eaten = this.eatenBefore(step, agent);
      items += eaten;
      if (eaten) eaters += 1;
    }
    return `${items.toLocaleString("en")} eaten · ${eaters} of ${this.agents} ate`;
  }
}

/** How many moves happen at or before a step: `move_step` rises. */
function countMovesUntil(moveStep, step) {
  let [low, high] = [0, moveStep.length];
  while (low < high) {
    const middle = (low + high) >> 1;
    if (moveStep[middle] <= step) low = middle + 1;
    else high = middle;
  }
  return low;
}

/** Items that all agents together eat in each step. */
function mealsOf({ agents, first, arrays: { eaten_in_life: eaten } }) {
  const meals = new Uint16Array(eaten.length / agents);
  let previous = null;
  for (let row = 0; row < meals.length; row++) {
    let sum = 0;
    for (let at = row * agents; at < (row + 1) * agents; at++) sum += eaten[at];
    meals[row] = sum - (previous ?? (first ? sum : 0)); // what was eaten before the first step of a part is not known
    previous = sum;
  }
  return meals;
}

/** A whole lifetime, in one part or, where that would be too large, in parts that are fetched as they are needed. */
export class Lifetime {
  /**
   * @param {(part: {first: number, last: number}|null, signal: AbortSignal) => Promise<Recording>} fetchPart null: what one answer holds
   * @param {() => void} changed called when a part has come
   * @param {(fault: Error) => void} failed called when none will
   */
  constructor(fetchPart, changed, failed) {
    Object.assign(this, { fetchPart, changed, failed });
    this.parts = new Map(); // by number, the part used last at the end
    this.length = 0; // steps in a part; 0 until the first has come
    this.loadingPart = null;
    this.stop = new AbortController();
    this.fetch(0);
  }

  /** The part that holds a step, or null while it is on its way. The one after it is fetched in time. */
  at(step) {
    if (!this.length) return null;
    const number = Math.floor(step / this.length);
    const part = this.parts.get(number);
    if (!part) {
      this.fetch(number);
      return null;
    }
    if (this.parts.size > 1) {
      this.parts.delete(number);
      this.parts.set(number, part);
    }
    if (part.last < part.steps && step - part.first > this.length / 2) this.fetch(number + 1);
    return part;
  }

  /** The nearest step after another (`way` 1) or before it (-1) in which an agent, or null: any of them, eats; null: none that is here. */
  meal(step, direction, agent) {
    for (let at = step + direction; at >= 0 && at < this.steps; at += direction) {
      const part = this.parts.get(Math.floor(at / this.length));
      if (!part) return null;
      if (part.eats(at, agent)) return at;
    }
    return null;
  }

  async fetch(number) {
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
    } catch (fault) {
      if (fault.name === "AbortError") return;
      this.failedOnce = true;
      this.failed(fault);
    } finally {
      this.loadingPart = null;
    }
    this.changed();
  }

  /** Forget everything, and what is on its way. */
  close() {
    this.stop.abort();
    this.parts.clear();
  }
}
