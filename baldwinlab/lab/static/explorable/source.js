/** The simulations of the essay: live runs in one worker, or recorded runs without WebAssembly. */

import { inflate, unpack } from "../core/common.js";
import { applyChanges } from "../core/experiment_changes.js";
import { createRecordingHeader, fillTemplate, findProgram } from "../engine/program_table.js";
import { computeMean } from "../charts/quantiles.js";
import { Recording } from "../world/recording.js";
import { WorkerPool } from "../engine/worker_pool.js";
import { wait } from "./figure.js";

// Share of the time of one core that the worker can use.
const MAX_LOAD = 0.5;
// Milliseconds of a recorded generation.
const RECORDED_PAUSE = 60;

/**
 * @typedef {object} PageData the data that Python writes into the page (pages/explorable/__init__.py)
 * @property {number} seed
 * @property {number} fork_generation
 * @property {number} evolution_generations of a run on a map
 * @property {{run: number, generation: number}} first_life
 * @property {number[]} region the part of the map with the agents: its left, right, upper and lower
 *   edge
 * @property {Object<string, {experiment: object, appearance: object}>} scenes
 * @property {{name: string, when: Object<string, any>, module: string, plan: object}[]} programs
 * @property {{curves: Object<string, number[][]>, lives: Object<string, string>,
 *   learner: {agent: number, genome: number[]}, newborns: Object<string, number>,
 *   hiding: number}} recordings
 * @property {Object<string, any>} needle settings of the strings that guess
 * @property {Object<string, any>} climbers settings of the strings on landscapes
 * @property {Object<string, Object<string, string>>} strings
 */

/** Live runs. All of them share one worker, so that the page uses one core at most. */
export class LiveSource {
  /**
   * @param {PageData} data
   * @param {string} code of a worker
   */
  constructor(data, code) {
    this.data = data;
    this.isLive = true;
    this.pool = new WorkerPool(code, data.programs);
    this.populations = 0;
    this.learners = null;
  }

  /** Return a recording of the first life with some settings changed. */
  async recordLearners(changes) {
    const { run, generation } = this.data.first_life;
    this.learners ??= this.evolveLearners(run, generation);
    return (await this.learners).recordLife(run, generation, changes);
  }

  async evolveLearners(run, generation) {
    const learners = await this.start("learning", {}, [run]);
    while (learners.generation <= generation) await learners.next();
    return learners;
  }

  /**
   * Start runs of a scene.
   * @param {string} scene
   * @param {Object<string, any>} changes settings by path
   * @param {number[]} runs their numbers
   */
  start(scene, changes, runs) {
    const { experiment, appearance } = this.data.scenes[scene];
    return this.startExperiment(applyChanges(experiment, changes), appearance, runs);
  }

  /** Start runs of an experiment. `program` is chosen by its settings, unless it is given. */
  async startExperiment(experiment, appearance, runs, seed = this.data.seed, program = null) {
    program ??= findProgram(this.data.programs, experiment);
    const population = new LivePopulation(this, { program, experiment, appearance, runs, seed });
    await population.request("begin", { runs });
    return population;
  }

  async request(program, command, parameters) {
    const worker = await this.pool.prepareWorker(0, program);
    return worker.request(command, { program: program.name, ...parameters });
  }

  /** For scripts: simulate a run, bit-identical to `bl.simulate`. */
  simulate({ scene, changes = {}, run = 0 }) {
    const experiment = applyChanges(this.data.scenes[scene].experiment, changes);
    const program = findProgram(this.data.programs, experiment);
    return this.pool.simulate(program, experiment, this.data.seed, run);
  }
}

/** Some runs of an experiment that evolve together. */
class LivePopulation {
  constructor(source, { program, experiment, appearance, runs, seed }) {
    this.source = source;
    this.program = program;
    this.experiment = experiment;
    this.appearance = appearance;
    this.runs = runs;
    this.seed = seed;
    this.generation = 0;
    this.group = `population ${++source.populations}`;
  }

  request(command, parameters = {}) {
    const { experiment, seed, group } = this;
    return this.source.request(this.program, command, { experiment, seed, group, ...parameters });
  }

  /** Simulate a generation. Return the mean number of eaten items per agent of each run. */
  async next() {
    const start = performance.now();
    const results = await this.request("next");
    this.generation += 1;
    await wait((performance.now() - start) * (1 / MAX_LOAD - 1));
    return results.map(({ food_eaten: eaten }) => computeMean(eaten));
  }

  /** Continue all runs with changed settings. */
  async fork(changes) {
    const experiment = applyChanges(this.experiment, changes);
    const fork = new LivePopulation(this.source, { ...this, experiment });
    fork.generation = this.generation;
    await fork.request("fork", { source: this.group });
    return fork;
  }

  /** Return a recording of a past generation, with some settings changed. */
  async recordLife(run, generation, changes = {}) {
    const experiment = applyChanges(this.experiment, changes);
    const appearance = fillTemplate(this.appearance, experiment);
    const genome = await this.request("genome", { run, generation });
    const recorded = await this.request("recording", {
      experiment,
      run,
      generation,
      genome,
      appearance,
    });
    const header = createRecordingHeader(experiment, appearance, recorded, generation);
    return new Recording({ header, arrays: recorded.arrays });
  }

  close() {
    this.request("end");
  }
}

/** Recorded runs, which the engine made for the page. */
export class RecordedSource {
  /** @param {PageData} data */
  constructor(data) {
    this.data = data;
    this.isLive = false;
    // The decoded lifetimes, by name: "learning" and "alone".
    this.lives = new Map();
  }

  /** Decode all lifetimes, so that they can be shown at once, for example on paper. */
  async loadLives() {
    for (const name of Object.keys(this.data.recordings.lives)) await this.loadLife(name);
  }

  start(scene, _changes, runs) {
    return Promise.resolve(new RecordedPopulation(this, scene, runs));
  }

  /** Return a recorded lifetime. */
  async loadLife(name) {
    if (!this.lives.has(name)) {
      const container = unpack(await inflate(this.data.recordings.lives[name]));
      this.lives.set(name, new Recording(container));
    }
    return this.lives.get(name);
  }

  recordLearners() {
    return this.loadLife("learning");
  }
}

/** A run without learning, for browsers that cannot simulate it. */
class RecordedPopulation {
  constructor(source, scene, runs) {
    this.source = source;
    this.runs = runs;
    this.curves = source.data.recordings.curves[scene];
    this.generation = 0;
  }

  async next() {
    const means = this.runs.map((run) => this.curves[run][this.generation]);
    this.generation += 1;
    await wait(RECORDED_PAUSE);
    return means;
  }

  recordLife() {
    return this.source.loadLife("alone");
  }

  close() {}
}
