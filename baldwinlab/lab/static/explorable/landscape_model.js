/**
 * Bit strings that climb an NK landscape during life, as models/nk_climbers.py.
 *
 * A string is an integer: bit i of the integer is bit i of the string.
 */

import { createRandom, drawInteger } from "./random.js";

// Agents drawn for each parent. The fittest of them is the parent.
const TOURNAMENT = 3;
const LANDSCAPE_STREAM = 1;

/**
 * Return the fitness of each string, from 0 of the worst to 1 of the best one.
 *
 * Fitness is the mean of one table entry per bit. The bit and `k` further bits select the entry.
 * @param {number} bits
 * @param {number} k
 * @param {() => number} random
 */
export function createLandscape(bits, k, random) {
  const fitness = new Float64Array(2 ** bits);
  for (let bit = 0; bit < bits; bit++) {
    const table = Float64Array.from({ length: 2 ** (k + 1) }, random);
    const links = [bit, ...drawOthers(bits, bit, k, random)];
    for (let string = 0; string < fitness.length; string++) {
      let entry = 0;
      for (let power = 0; power <= k; power++) entry |= ((string >> links[power]) & 1) << power;
      fitness[string] += table[entry];
    }
  }
  const low = fitness.reduce((lowest, value) => Math.min(lowest, value));
  const high = fitness.reduce((highest, value) => Math.max(highest, value));
  return fitness.map((value) => (value - low) / (high - low));
}

/** Return `count` different bits other than `bit`, in random order. */
function drawOthers(bits, bit, count, random) {
  const others = Array.from({ length: bits }, (_, index) => index).filter((index) => index !== bit);
  for (let index = 0; index < count; index++) {
    const chosen = index + drawInteger(random, others.length - index);
    [others[index], others[chosen]] = [others[chosen], others[index]];
  }
  return others.slice(0, count);
}

/**
 * @typedef {object} ClimberSettings
 * @property {number} agents
 * @property {number} bits
 * @property {number} k further bits on which the fitness of a bit depends
 * @property {number} trials of a life, each with one flipped bit; 0: no learning
 * @property {number} mutation_rate
 */

/** A population on one landscape. All founders are the same random string. */
export class ClimberPopulation {
  /**
   * @param {ClimberSettings} settings
   * @param {Float64Array} landscape
   * @param {number} founder a string
   * @param {() => number} random
   */
  constructor(settings, landscape, founder, random) {
    this.settings = settings;
    this.landscape = landscape;
    this.random = random;
    this.strings = new Int32Array(settings.agents).fill(founder);
    this.learned = null;
  }

  /** Simulate the lifetimes of the next generation. Return its mean fitness at birth and death. */
  next() {
    if (this.learned) this.breed();
    this.learned = this.strings.map((string) => this.climb(string));
    return { born: this.computeMean(this.strings), died: this.computeMean(this.learned) };
  }

  /** Flip a random bit in each trial. The flip remains if it raises the fitness. */
  climb(string) {
    const { bits, trials } = this.settings;
    for (let trial = 0; trial < trials; trial++) {
      const flipped = string ^ (1 << drawInteger(this.random, bits));
      if (this.landscape[flipped] > this.landscape[string]) string = flipped;
    }
    return string;
  }

  computeMean(strings) {
    return strings.reduce((sum, string) => sum + this.landscape[string], 0) / strings.length;
  }

  /** Replace the strings by mutated copies of parents. Learned bits are not inherited. */
  breed() {
    const { bits, mutation_rate: mutationRate } = this.settings;
    this.strings = this.strings.map(() => {
      let string = this.strings[this.drawParent()];
      for (let bit = 0; bit < bits; bit++) if (this.random() < mutationRate) string ^= 1 << bit;
      return string;
    });
  }

  drawParent() {
    const { length } = this.learned;
    let best = drawInteger(this.random, length);
    for (let drawn = 1; drawn < TOURNAMENT; drawn++) {
      const agent = drawInteger(this.random, length);
      if (this.landscape[this.learned[agent]] > this.landscape[this.learned[best]]) best = agent;
    }
    return best;
  }

  /** Switch learning off from the next generation on. */
  stopLearning() {
    this.settings = { ...this.settings, trials: 0 };
  }
}

/**
 * Return two populations on the same landscape, from the same founder: with and without learning.
 * @param {ClimberSettings} settings
 * @param {number} seed
 * @param {number} run
 */
export function createClimbers(settings, seed, run) {
  const random = createRandom(seed, run, LANDSCAPE_STREAM);
  const landscape = createLandscape(settings.bits, settings.k, random);
  const founder = drawInteger(random, landscape.length);
  const create = (trials, stream) =>
    new ClimberPopulation(
      { ...settings, trials },
      landscape,
      founder,
      createRandom(seed, run, stream),
    );
  return {
    learners: create(settings.trials, LANDSCAPE_STREAM + 1),
    control: create(0, LANDSCAPE_STREAM + 2),
  };
}
