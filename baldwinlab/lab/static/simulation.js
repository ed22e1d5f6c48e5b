/** A run in the browser, from its founders to its last generation, as simulation/simulate.py has it. Needs no page. */

import { Engine, lookUp } from "./engine.js";

const FAULTS = {
  1: (path) => `evolution.fitness = "${path("evolution.fitness")}" gave no number for some agents.`,
  2: (path) =>
    `evolution.selection = "${path("evolution.selection")}" cannot work with a fitness below 0 or without end; choose rank or tournament.`,
  3: (path) =>
    `evolution.selection = "${path("evolution.selection")}" chose a parent that is none of the agents.`,
};

/**
 * @typedef {object} Generation what became of one, an entry for each agent
 * @property {Int32Array} food_eaten
 * @property {Float64Array} energy fitness
 * @property {Int32Array} parents [agent, (fitter, other)]; -1 for none
 * @property {Float32Array} genome [agent, module, weight]
 */

export class Run {
  /** @param {import("./engine.js").Program} program of the parts that the experiment chooses */
  constructor(program, experiment, seed, run) {
    this.engine = new Engine(program);
    this.engine.prepare(experiment, { seed, run });
    Object.assign(this, { experiment, seed, run, lived: 0 });
    this.generations = experiment.evolution.generations;
    this.engine.call("found");
    this.parents = this.elders = this.engine.array("population.parents").fill(-1).slice();
  }

  /** Live the next generation, and let it have its children if there is one after it. Raises an Error with a sentence. */
  next() {
    const genome = this.begin();
    this.live(0, this.experiment.lifetime.steps);
    return this.end(genome);
  }

  /** Let the next generation be born. @returns {Float32Array} its genomes */
  begin() {
    const genome = this.engine.array("population.genome").slice();
    this.bear(this.lived);
    return genome;
  }

  /** What became of the generation that has lived. */
  end(genome) {
    const { engine, parents } = this;
    engine.call("reckon");
    this.check();
    const agents = this.experiment.population.size;
    const lived = {
      food_eaten: engine.array("population.eaten_of_kind").slice(0, agents),
      energy: engine.array("population.energy").slice(),
      parents,
      genome,
    };
    this.lived += 1;
    if (this.lived < this.generations) {
      engine.call("breed");
      this.check();
      this.requireFinite();
      this.parents = engine.array("population.parents").slice();
      this.elders = this.eldersOf(this.parents);
    }
    return lived;
  }

  /** Whose learned weights the teachers of those just bred would be passed on from, as `parents`: see evolution/inheritance.py. */
  eldersOf(parents) {
    const { teacher } = this.experiment.learning;
    if (teacher === "fresh") return null;
    if (teacher !== "shuffled") return parents;
    const order = this.engine.array("population.order"); // whose teacher each child was dealt, the last thing that `breed` does
    return parents.map((_, at) => parents[2 * Number(order[at >> 1]) + (at & 1)]);
  }

  /** Let a generation be born, of the genomes that stand there. */
  bear(generation) {
    this.engine.set("population.generation", generation);
    this.engine.call("begin");
  }

  live(first, last) {
    this.engine.set("population.first_step", first);
    this.engine.set("population.last_step", last);
    this.engine.call("live");
  }

  check() {
    const fault = FAULTS[this.engine.array("population.fault")[0]];
    if (fault) throw new Error(fault((path) => lookUp(this.experiment, path)));
  }

  /** As evolution/finite.py, but minus infinity is allowed: genomes that are graphs have it. */
  requireFinite() {
    const at = this.engine.array("population.genome").findIndex((gene) => !(gene < Infinity));
    if (at < 0) return;
    const [, modules, genes] = this.engine.arrays["population.genome"].shape;
    const [agent, module, gene] = [
      Math.floor(at / (modules * genes)),
      Math.floor(at / genes) % modules,
      at % genes,
    ];
    throw new Error(
      `Gene ${gene} of module ${module} of agent ${agent} in generation ${this.lived} is not a finite number: ` +
        "choose a smaller learning.rate, evolution.lamarckian_share or evolution.mutation_size.",
    );
  }
}

/** A whole run: the variables of `bl.simulate`, generation after generation. */
export function simulate(program, experiment, seed, run) {
  const made = new Run(program, experiment, seed, run);
  const all = Array.from({ length: made.generations }, () => made.next());
  return Object.fromEntries(
    Object.keys(all[0]).map((name) => [name, concatenate(all.map((one) => one[name]))]),
  );
}

/** Arrays of a kind, one after the other. */
export function concatenate(arrays) {
  const whole = new arrays[0].constructor(arrays.reduce((length, one) => length + one.length, 0));
  let at = 0;
  for (const one of arrays) {
    whole.set(one, at);
    at += one.length;
  }
  return whole;
}
