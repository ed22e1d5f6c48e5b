/** A run in the browser, as simulation/simulate.py. Needs no page. */

import { Engine, lookUp } from "./engine.js";

const ERRORS = {
  1: (path) => `evolution.fitness = "${path("evolution.fitness")}" gave no number for some agents.`,
  2: (path) =>
    `evolution.selection = "${path("evolution.selection")}" cannot work with a fitness ` +
    "below 0 or without end; choose rank or tournament.",
  3: (path) =>
    `evolution.selection = "${path("evolution.selection")}" chose a parent that is none ` +
    "of the agents.",
};

/**
 * @typedef {object} Generation the results, one entry per agent
 * @property {Int32Array} food_eaten
 * @property {Float64Array} energy fitness
 * @property {Int32Array} parents [agent, (fitter, other)]; -1 for none
 * @property {Float32Array} genome [agent, module, weight]
 */

export class Run {
  /** @param {import("./engine.js").Program} program for the parts of the experiment */
  constructor(program, experiment, seed, run) {
    this.engine = new Engine(program);
    this.engine.prepare(experiment, { seed, run });
    this.experiment = experiment;
    this.seed = seed;
    this.run = run;
    this.generationsDone = 0;
    this.generations = experiment.evolution.generations;
    this.engine.call("init_founders");
    this.parents = this.engine.array("population.parents").fill(-1).slice();
  }

  /** Continue another run that has genomes of the same size. */
  continueFrom({ engine, generationsDone, parents }) {
    this.engine.array("population.genome").set(engine.array("population.genome"));
    this.generationsDone = generationsDone;
    this.parents = parents;
  }

  /** Simulate the next generation and its reproduction. Throw an Error for invalid results. */
  simulateNext() {
    const genome = this.startNext();
    this.simulateSteps(0, this.experiment.lifetime.steps);
    return this.finishGeneration(genome);
  }

  /**
   * Start the next generation.
   * @returns {Float32Array} its genomes
   */
  startNext() {
    const genome = this.engine.array("population.genome").slice();
    this.startGeneration(this.generationsDone);
    return genome;
  }

  /** Return the results of the generation, and create the next one. */
  finishGeneration(genome) {
    const { engine, parents } = this;
    engine.call("compute_fitness");
    this.requireValid();
    const agents = this.experiment.population.size;
    const result = {
      food_eaten: engine.array("population.eaten_by_kind").slice(0, agents),
      energy: engine.array("population.fitness").slice(),
      parents,
      genome,
    };
    this.generationsDone += 1;
    if (this.generationsDone < this.generations) {
      engine.call("breed");
      this.requireValid();
      this.requireFinite();
      this.parents = engine.array("population.parents").slice();
    }
    return result;
  }

  /** Start a generation with the current genomes. */
  startGeneration(generation) {
    this.engine.set("population.generation", generation);
    this.engine.call("begin");
  }

  simulateSteps(first, last) {
    this.engine.set("population.first_step", first);
    this.engine.set("population.last_step", last);
    this.engine.call("simulate");
  }

  requireValid() {
    const error = ERRORS[this.engine.array("population.fault")[0]];
    if (error) throw new Error(error((path) => lookUp(this.experiment, path)));
  }

  /** Check genomes as evolution/genes.py. Genomes of graphs may contain minus infinity. */
  requireFinite() {
    const index = this.engine.array("population.genome").findIndex((gene) => !(gene < Infinity));
    if (index < 0) return;
    const [, modules, genes] = this.engine.arrays["population.genome"].shape;
    const agent = Math.floor(index / (modules * genes));
    const module = Math.floor(index / genes) % modules;
    const gene = index % genes;
    throw new Error(
      `Gene ${gene} of module ${module} of agent ${agent} in generation ` +
        `${this.generationsDone} is not a finite number: ` +
        "choose a smaller learning.rate, evolution.lamarckian_share or evolution.mutation_size.",
    );
  }
}

/** Simulate a complete run, and return the variables of `bl.simulate`. */
export function simulate(program, experiment, seed, run) {
  const simulation = new Run(program, experiment, seed, run);
  const generations = Array.from(
    { length: simulation.generations },
    () => simulation.simulateNext(),
  );
  return Object.fromEntries(
    Object.keys(generations[0]).map((name) => [
      name,
      concatenate(generations.map((array) => array[name])),
    ]),
  );
}

/** Concatenate arrays of one type. */
export function concatenate(arrays) {
  const joined = new arrays[0].constructor(
    arrays.reduce((length, array) => length + array.length, 0),
  );
  let index = 0;
  for (const array of arrays) {
    joined.set(array, index);
    index += array.length;
  }
  return joined;
}
