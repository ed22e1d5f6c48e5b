/** A frame of a world with many agents: the visible agents and items, or their density. */

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
export function readFrames({ header, arrays }) {
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
