/** Live runs on an exported page: a pool of workers, and a feed of their results. */

import { inflate } from "./common.js";
import { ancestorLine } from "./ancestry.js";
import { Feed } from "./live_feed.js";

const MOST_WORKERS = 16;

/** The workers of the page, one per core, with the compiled modules that they have loaded. */
export class WorkerPool {
  constructor(code, programs) {
    this.address = URL.createObjectURL(new Blob([code], { type: "text/javascript" }));
    this.programs = programs;
    // By number. One extra worker replays lifetimes, so that live runs do not wait.
    this.pool = {};
    this.nextWorker = 0;
  }

  /** Maximum number of workers. */
  get maxWorkers() {
    return Math.min(navigator.hardwareConcurrency || 2, MOST_WORKERS);
  }

  /** Return a worker, by its number or name, that has loaded a compiled module. */
  async ready(name, program) {
    const worker = (this.pool[name] ??= new WorkerClient(new Worker(this.address)));
    await (worker.programs[program.name] ??= (async () => {
      program.bytes ??= new Uint8Array(await inflate(program.module));
      await worker.request("program", {
        name: program.name,
        bytes: program.bytes,
        plan: program.plan,
      });
    })());
    return worker;
  }

  /** Prepare the first worker in advance. */
  async warm(program, experiment) {
    const worker = await this.ready(0, program);
    await worker.request("warm", { program: program.name, experiment });
  }

  /** Simulate a run on the next worker. */
  async simulate(program, experiment, seed, run) {
    const worker = await this.ready(this.nextWorker++ % this.maxWorkers, program);
    return worker.request("simulate", { program: program.name, experiment, seed, run });
  }
}

/** The page's side of a worker: requests and their responses. */
class WorkerClient {
  constructor(worker) {
    Object.assign(this, { worker, waiting: new Map(), programs: {}, ticket: 0 });
    worker.onmessage = ({ data: { ticket, answer, error } }) => {
      const { resolve, reject } = this.waiting.get(ticket);
      this.waiting.delete(ticket);
      if (error === undefined) resolve(answer);
      else reject(new Error(error));
    };
    worker.onerror = (event) => {
      for (const { reject } of this.waiting.values())
        reject(new Error(`The page's worker failed: ${event.message ?? "it does not start"}.`));
      this.waiting.clear();
    };
  }

  request(order, given) {
    return new Promise((resolve, reject) => {
      this.waiting.set(++this.ticket, { resolve, reject });
      this.worker.postMessage({ ticket: this.ticket, command: order, parameters: given });
    });
  }
}

/**
 * The feed of a run of the browser engine, with the data of `recording`, `inspectAgent` and `ancestors`.
 */
export class BrowserFeed extends Feed {
  /**
   * @param {import("./browser_lab.js").BrowserLab} here
   * @param {Object<string, any>|null} order null if the link is damaged
   */
  constructor(id, here, order) {
    super(id);
    Object.assign(this, { lab: here, order, steps: 0, history: [], wakeUp: () => {} });
  }

  connect() {
    queueMicrotask(() => this.run());
  }

  async run() {
    const faults = this.order
      ? this.lab.faults(this.order.experiment)
      : [{ message: "This link is damaged and does not describe a run" }];
    if (faults.length) return this.setState("gone", `${faults[0].message}.`);
    const { experiment, runs, seed, seconds = 0 } = this.order;
    this.summary = { id: this.id, experiment, runs, seed, seconds, saved_as: "" };
    this.onUpdate();
    try {
      await this.prepare(experiment, runs, seed);
      this.setState(this.wanted ?? "running");
      while (this.generationsDone < experiment.evolution.generations && !this.ended) {
        if (this.state === "paused" && !this.steps)
          await new Promise((resolve) => (this.wakeUp = resolve));
        else await this.simulateGeneration();
      }
      if (!this.ended) this.setState("done");
    } catch (fault) {
      if (!this.ended) this.setState("failed", fault.message);
    }
  }

  /** Distribute the runs over the workers. */
  async prepare(experiment, runs, seed) {
    const { workers } = this.lab;
    const program = this.lab.program(experiment);
    this.groups = [];
    for (let run = 0; run < runs; run++) (this.groups[run % workers.maxWorkers] ??= []).push(run);
    this.workers = await Promise.all(
      this.groups.map((_, number) => workers.ready(number, program)),
    );
    const given = { group: this.id, program: program.name, experiment, seed };
    await this.requestAll((number) => ["begin", { ...given, runs: this.groups[number] }]);
  }

  requestAll(order) {
    return Promise.all(
      (this.workers ?? []).map((worker, number) => worker.request(...order(number))),
    );
  }

  async simulateGeneration() {
    const start = performance.now();
    this.steps = Math.max(0, this.steps - 1);
    const results = (await this.requestAll(() => ["next", { group: this.id }]))
      .flat()
      .sort((value, other) => value.run - other.run);
    // The run was stopped within a lifetime.
    if (this.ended) return;
    this.history.push(results);
    this.add(bandsOf(results, this.lab.laboratory.quantiles));
    this.onUpdate();
    const pauseTime = 1000 * this.summary.seconds - (performance.now() - start);
    if (pauseTime > 0 && this.state === "running") {
      await new Promise((resolve) => {
        this.wakeUp = resolve;
        setTimeout(resolve, pauseTime);
      });
    }
  }

  send({ do: command, seconds }) {
    if (command === "pace") this.summary.seconds = seconds;
    else if (command === "step") this.steps += 1;
    else if (!this.workers || this.state === "preparing")
      this.wanted = { pause: "paused", stop: "stopped" }[command];
    else this.setState({ pause: "paused", resume: "running", stop: "stopped" }[command]);
    if (command === "stop") this.requestAll(() => ["stop", { group: this.id }]);
    this.wakeUp();
  }

  setState(state, message = "") {
    Object.assign(this, { state, message });
    this.onUpdate();
  }

  /** Return the container of a recording. */
  async recording(source, { run, generation, first, last }) {
    const { experiment, seed } = this.summary;
    const appearance = this.lab.appearance(experiment);
    const { part, sizes, arrays } = await this.replay("recording", {
      run,
      generation,
      appearance,
      first,
      last,
    });
    const {
      name: condition,
      lifetime: { steps },
      population: { size: agents },
      world,
      network: { biases },
    } = experiment;
    const header = {
      kind: "recording",
      source,
      condition,
      seed,
      run,
      generation,
      ...part,
      steps,
      agents,
      items: arrays.item_x.length,
      world,
      appearance,
      topics: [],
    };
    return {
      header: {
        ...header,
        learns: experiment.learning.rule !== "none",
        layer_sizes: sizes,
        biases,
      },
      arrays,
    };
  }

  /** Return the container about one agent. */
  async inspectAgent({ run, generation, agent, first, last }) {
    const { experiment } = this.summary;
    const appearance = this.lab.appearance(experiment);
    const { part, sizes, arrays } = await this.replay("agent", {
      run,
      generation,
      agent,
      appearance,
      first,
      last,
    });
    const { parents: parentPairs, teachers: teacherPairs, energy } = this.history[generation][run];
    const next = this.history[generation + 1]?.[run].parents;
    const couple = (pairs) =>
      pairs && pairs[0] >= 0 ? Array.from(pairs.subarray(2 * agent, 2 * agent + 2)) : null;
    const children = next
      ? Array.from({ length: next.length / 2 }, (_, child) => child).filter(
          (child) => next[2 * child] === agent || next[2 * child + 1] === agent,
        )
      : [];
    const header = {
      kind: "agent",
      agent,
      ...part,
      appearance,
      layer_sizes: sizes,
      biases: experiment.network.biases,
    };
    const teachers = this.lab.hasParentTeachers(experiment) ? couple(teacherPairs) : null;
    const kin = {
      parents: couple(parentPairs),
      teachers,
      children,
      food: arrays.eaten_in_life.at(-1),
      rank: 1 + energy.filter((value) => value > energy[agent]).length,
    };
    return { header: { ...header, ...kin }, arrays };
  }

  /** Return the ancestors of an agent. */
  ancestors({ run, generation, agent }) {
    return ancestorLine(
      this.history.slice(0, generation + 1).map((results) => results[run]),
      agent,
    );
  }

  /** Replay a lifetime on a worker. */
  async replay(order, wanted) {
    const { run, generation } = wanted;
    const { workers } = this.lab;
    const genome = await this.workers[run % workers.maxWorkers].request("genome", {
      group: this.id,
      run,
      generation,
    });
    const { experiment, seed } = this.summary;
    const program = this.lab.program(experiment);
    return (await workers.ready("replay", program)).request(order, {
      program: program.name,
      experiment,
      seed,
      genome,
      ...wanted,
    });
  }

  disconnect() {
    this.state = "stopped";
    this.wakeUp();
    this.lab.feeds.delete(this.id);
    for (const worker of this.workers ?? []) worker.request("end", { group: this.id });
  }
}

/** Return best fitness, mean fitness and the share of agents that eat, as bands over runs. */
function bandsOf(results, quantiles) {
  const measures = {
    best: results.map(({ energy }) => Math.max(...energy)),
    mean: results.map(({ energy }) => meanOf(energy)),
    share: results.map(
      ({ food_eaten }) => food_eaten.filter((items) => items > 0).length / food_eaten.length,
    ),
  };
  return Object.fromEntries(
    Object.entries(measures).map(([name, values]) => [
      name,
      band(values, quantiles, name === "share" ? 1 : Infinity),
    ]),
  );
}

/**
 * Return the mean of several values with its 95 % interval, which stays within 0 and `most`.
 *
 * The interval can be negative if a value is negative.
 */
function band(values, quantiles, maxWorkers) {
  const mean = meanOf(values);
  if (values.length === 1) return { mean: [mean] };
  const spread = values.reduce((sum, value) => sum + (value - mean) ** 2, 0) / (values.length - 1);
  const half = Math.sqrt(spread / values.length) * quantiles[values.length];
  const low = values.some((value) => value < 0) ? mean - half : Math.max(0, mean - half);
  return { mean: [mean], low: [low], high: [Math.min(maxWorkers, mean + half)], runs: [values] };
}

function meanOf(values) {
  return values.reduce((sum, value) => sum + value, 0) / values.length;
}
