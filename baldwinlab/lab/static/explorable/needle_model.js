/**
 * Strings of 0, 1 and ? that guess during life, as models/hinton_nowlan.py.
 *
 * Only a string that is right at each position gains fitness. An agent guesses all its ? in each
 * trial of its life, and stops at the first success. Its children inherit each ? as ?.
 */

import { createRandom, drawInteger } from "./random.js";

// The allele "?". The alleles 0 and 1 are the numbers 0 and 1.
export const OPEN = 2;
const ALLELES = 3;
// Maximum gain in fitness above the baseline of 1.
const MAX_GAIN = 19;

/**
 * @typedef {object} NeedleSettings
 * @property {number} agents
 * @property {number} loci positions of a string
 * @property {number} trials of a life; 0: agents do not guess
 * @property {number} cost of a trial, as a factor of the cost 19 / trials
 * @property {number} mutation_rate
 * @property {number} period generations between changes of the target; 0: it never changes
 * @property {number} redrawn_loci positions that are drawn at a change
 */

export class NeedlePopulation {
  /**
   * @param {NeedleSettings} settings
   * @param {...number} keys of the random numbers
   */
  constructor(settings, ...keys) {
    this.settings = settings;
    this.random = createRandom(...keys);
    this.generation = 0;
    const { agents, loci } = settings;
    this.target = new Uint8Array(loci).fill(1);
    // [agent, locus]. Half of the alleles of the founders are ?.
    this.genomes = Uint8Array.from(
      { length: agents * loci },
      () => (this.random() < 0.5 ? OPEN : drawInteger(this.random, 2)),
    );
    this.fitness = new Float64Array(agents);
    // By number of ?, see `listFailures`.
    this.failures = new Map();
  }

  /** Simulate the lifetimes of the next generation. Return its means over agents. */
  next() {
    if (this.generation) this.breed();
    const { period } = this.settings;
    if (period && this.generation && this.generation % period === 0) this.moveTarget();
    this.generation += 1;
    return this.simulateLifetimes();
  }

  moveTarget() {
    const { loci, redrawn_loci: redrawnLoci } = this.settings;
    for (let draw = 0; draw < redrawnLoci; draw++)
      this.target[drawInteger(this.random, loci)] = drawInteger(this.random, 2);
  }

  simulateLifetimes() {
    const { agents, loci, trials } = this.settings;
    const sums = { right: 0, wrong: 0, open: 0, trials: 0, succeeded: 0 };
    for (let agent = 0; agent < agents; agent++) {
      const { open, wrong } = this.countAlleles(agent);
      const used = wrong ? Infinity : this.drawFirstSuccess(open);
      const isSuccess = used <= Math.max(trials, 1) && (trials > 0 || open === 0);
      this.fitness[agent] = isSuccess ? 1 + MAX_GAIN * this.computeRest(used) : 1;
      sums.open += open;
      sums.wrong += wrong;
      sums.right += loci - open - wrong;
      sums.trials += isSuccess ? used : trials;
      sums.succeeded += isSuccess ? 1 : 0;
    }
    return {
      right: sums.right / (agents * loci),
      wrong: sums.wrong / (agents * loci),
      open: sums.open / (agents * loci),
      trials: sums.trials / agents,
      succeeded: sums.succeeded / agents,
    };
  }

  countAlleles(agent) {
    const { genomes, target } = this;
    const { loci } = this.settings;
    let open = 0;
    let wrong = 0;
    for (let locus = 0; locus < loci; locus++) {
      const allele = genomes[agent * loci + locus];
      if (allele === OPEN) open += 1;
      else if (allele !== target[locus]) wrong += 1;
    }
    return { open, wrong };
  }

  /**
   * Return the first trial that succeeds, or a later one than the last. Each trial succeeds with the
   * probability 2^-open, so trials 1 to t fail with the probability (1 - 2^-open)^t.
   */
  drawFirstSuccess(open) {
    if (open === 0) return 1;
    const luck = this.random();
    const failures = this.listFailures(open);
    return 1 + countBefore(failures, (failure) => failure > luck);
  }

  /** Return the probability that the first t trials fail. Logarithms differ between browsers. */
  listFailures(open) {
    if (!this.failures.has(open)) {
      let failure = 1;
      const next = () => (failure *= 1 - 0.5 ** open);
      this.failures.set(open, Float64Array.from({ length: this.settings.trials }, next));
    }
    return this.failures.get(open);
  }

  /** Return the share of the gain that remains after a success. */
  computeRest(used) {
    const { trials, cost } = this.settings;
    return trials ? Math.max(0, 1 - (cost * used) / trials) : 1;
  }

  /** Replace the agents by their children. Parents are drawn in proportion to fitness. */
  breed() {
    const { agents, loci, mutation_rate: mutationRate } = this.settings;
    const children = new Uint8Array(agents * loci);
    const sums = this.fitness.slice();
    for (let agent = 1; agent < agents; agent++) sums[agent] += sums[agent - 1];
    for (let child = 0; child < agents; child++) {
      const first = this.drawParent(sums) * loci;
      const second = this.drawParent(sums) * loci;
      // One-point crossover.
      const cut = 1 + drawInteger(this.random, loci - 1);
      for (let locus = 0; locus < loci; locus++) {
        const inherited = this.genomes[(locus < cut ? first : second) + locus];
        children[child * loci + locus] = mutationRate && this.random() < mutationRate
          ? drawInteger(this.random, ALLELES)
          : inherited;
      }
    }
    this.genomes = children;
  }

  drawParent(sums) {
    const value = this.random() * sums[sums.length - 1];
    return Math.min(countBefore(sums, (sum) => sum <= value), sums.length - 1);
  }
}

/** Return the number of entries at the start of a sorted array for which a condition holds. */
function countBefore(array, condition) {
  let low = 0;
  let high = array.length;
  while (low < high) {
    const middle = (low + high) >> 1;
    if (condition(array[middle])) low = middle + 1;
    else high = middle;
  }
  return low;
}

// Halvings of the interval of the root, down to the precision of a number.
const HALVINGS = 60;

/** Return the mean fitness of a string with `open` alleles ? and no wrong one. */
function computeExpectedFitness(open, { trials, cost }) {
  const success = 0.5 ** open;
  let fitness = 1;
  // The probability that the first success is this trial.
  let probability = success;
  for (let trial = 1; trial <= trials; trial++) {
    fitness += probability * MAX_GAIN * Math.max(0, 1 - (cost * trial) / trials);
    probability *= 1 - success;
  }
  return fitness;
}

/** Return the relative gain in fitness if one ? becomes right. */
function computeSelection(open, settings) {
  const count = Math.max(open, 1);
  const fitness = computeExpectedFitness(count, settings);
  return (computeExpectedFitness(count - 1, settings) - fitness) / fitness;
}

/**
 * Return the share of ? at which mutation, change and selection balance: analysis/theory/needle.py.
 * @param {NeedleSettings} settings
 */
export function computeBalance(settings) {
  const { loci, mutation_rate: mutationRate, period, redrawn_loci: redrawnLoci } = settings;
  const gain = mutationRate / 3 + (period ? redrawnLoci / (2 * loci * period) : 0);
  const loss = mutationRate / 3;
  if (gain === 0) return 0;
  const computeSurplus = (share) =>
    (1 - share) * gain - share * (computeSelection(share * loci, settings) + loss);
  // The first root is that of populations that have found the needle.
  let high = 0;
  for (let locus = 0; locus <= loci; locus++) {
    high = locus / loci;
    if (computeSurplus(high) <= 0) break;
  }
  let low = 0;
  for (let halving = 0; halving < HALVINGS; halving++) {
    const middle = (low + high) / 2;
    if (computeSurplus(middle) > 0) low = middle;
    else high = middle;
  }
  return (low + high) / 2;
}
