/** Live runs on an exported page: a pool of workers, and a feed of their results. */

import { Feed } from "../live/live_feed.js";
import { createRecordingHeader } from "./program_table.js";
import { computeMean } from "../charts/quantiles.js";

/** The feed of a run of the browser engine, with recordings of its lifetimes. */
export class BrowserFeed extends Feed {
  /**
   * @param {import("./browser_lab.js").BrowserLab} lab
   * @param {Object<string, any>|null} order null if the link is damaged
   */
  constructor(id, lab, order) {
    super(id);
    this.lab = lab;
    this.order = order;
    this.steps = 0;
    /** @type {(value?: any) => void} */
    this.wakeUp = () => {};
  }

  connect() {
    queueMicrotask(() => this.run());
  }

  async run() {
    const errors = this.order
      ? this.lab.findErrors(this.order.experiment)
      : [{ message: "This link is damaged and does not describe a run" }];
    if (errors.length) return this.setState("removed", `${errors[0].message}.`);
    const { experiment, runs, seed, seconds = 0 } = this.order;
    const { measures } = this.lab.findPreset(experiment.name);
    this.summary = { id: this.id, experiment, measures, runs, seed, seconds, saved_as: "" };
    this.onUpdate();
    try {
      await this.prepare(experiment, runs, seed);
      this.setState(this.requestedState ?? "running");
      while (this.generationsDone < experiment.evolution.generations && !this.ended) {
        if (this.state === "paused" && !this.steps)
          await new Promise((resolve) => (this.wakeUp = resolve));
        else await this.simulateGeneration();
      }
      if (!this.ended) this.setState("done");
    } catch (error) {
      if (!this.ended) this.setState("failed", error.message);
    }
  }

  /** Distribute the runs over the workers. */
  async prepare(experiment, runs, seed) {
    const { workers } = this.lab;
    const program = this.lab.findProgram(experiment);
    this.groups = [];
    for (let run = 0; run < runs; run++) (this.groups[run % workers.maxWorkers] ??= []).push(run);
    this.workers = await Promise.all(
      this.groups.map((_, number) => workers.prepareWorker(number, program)),
    );
    const parameters = { group: this.id, program: program.name, experiment, seed };
    await this.requestAll((number) => ["begin", { ...parameters, runs: this.groups[number] }]);
  }

  requestAll(createRequest) {
    return Promise.all(
      (this.workers ?? []).map((worker, number) => worker.request(...createRequest(number))),
    );
  }

  async simulateGeneration() {
    const start = performance.now();
    this.steps = Math.max(0, this.steps - 1);
    const results = (await this.requestAll(() => ["next", { group: this.id }]))
      .flat()
      .sort((first, second) => first.run - second.run);
    // The run was stopped within a lifetime.
    if (this.ended) return;
    this.add(computeBands(results, this.lab.laboratory.quantiles));
    this.onUpdate();
    const pauseTime = 1000 * this.summary.seconds - (performance.now() - start);
    if (pauseTime > 0 && this.state === "running") {
      await new Promise((resolve) => {
        this.wakeUp = resolve;
        setTimeout(resolve, pauseTime);
      });
    }
  }

  send({ command, seconds }) {
    if (command === "pace") this.summary.seconds = seconds;
    else if (command === "step") this.steps += 1;
    else if (!this.workers || this.state === "preparing")
      this.requestedState = { pause: "paused", stop: "stopped" }[command];
    else this.setState({ pause: "paused", resume: "running", stop: "stopped" }[command]);
    if (command === "stop") this.requestAll(() => ["stop", { group: this.id }]);
    this.wakeUp();
  }

  setState(state, message = "") {
    this.state = state;
    this.message = message;
    this.onUpdate();
  }

  /** Return the container of a recording. */
  async loadRecording({ run, generation, first, last }) {
    const { experiment } = this.summary;
    const appearance = this.lab.describeAppearance(experiment);
    const genome = await this.loadGenome(run, generation);
    const parameters = { run, generation, genome, appearance, first, last };
    const recorded = await this.requestReplay("recording", parameters);
    return {
      header: createRecordingHeader(experiment, appearance, recorded, generation),
      arrays: recorded.arrays,
    };
  }

  /** Return the container of frames. */
  async loadFrames(source, { run, generation }) {
    const { experiment } = this.summary;
    const { world, population, lifetime } = experiment;
    const appearance = this.lab.describeAppearance(experiment);
    const query = readFrameQuery(source, world);
    const kindSizes = appearance.item_kinds.map(({ number }) => number);
    const life = [this.id, run, generation].join("/");
    const parameters = { life, run, generation, query, kindSizes };
    const send = (genome) => this.requestReplay("frames", { ...parameters, genome });
    const { frames, simulated, arrays } = (await send(null)) ??
      (await send(await this.loadGenome(run, generation)));
    const { interval, window } = query;
    const size = { steps: lifetime.steps, agents: population.size };
    const header = { kind: "frames", ...size, simulated, interval, frames, window };
    return { header: { ...header, world, appearance }, arrays };
  }

  /** Return the genomes of a generation. */
  loadGenome(run, generation) {
    const worker = this.workers[run % this.lab.workers.maxWorkers];
    return worker.request("genome", { group: this.id, run, generation });
  }

  /** Send a request to the worker that replays lifetimes. */
  async requestReplay(command, parameters) {
    const { experiment, seed } = this.summary;
    const program = this.lab.findProgram(experiment);
    const worker = await this.lab.workers.prepareWorker("replay", program);
    return worker.request(command, { program: program.name, experiment, seed, ...parameters });
  }

  disconnect() {
    this.state = "stopped";
    this.wakeUp();
    this.lab.feeds.delete(this.id);
    for (const worker of this.workers ?? []) worker.request("end", { group: this.id });
  }
}

/**
 * Return the steps and the window of a request, by default the complete map.
 * @returns {Object<string, any>}
 */
function readFrameQuery(source, { width, height }) {
  const steps = { first: 0, count: 0, interval: 1 };
  const completeMap = { left: 0, top: 0, right: width, bottom: height };
  const squares = { columns: 1, rows: 1, max_shapes: 1 };
  const read = (defaults) =>
    Object.fromEntries(
      Object.entries(defaults).map(([name, value]) => [name, Number(source[name] ?? value)]),
    );
  return { ...read(steps), window: read({ ...completeMap, ...squares }) };
}

/**
 * Return best fitness, mean fitness and the share of agents that eat, as bands over runs.
 * @returns {Object<string, import("../live/live_feed.js").Band>}
 */
function computeBands(results, quantiles) {
  const measures = {
    best: results.map(({ energy }) => Math.max(...energy)),
    mean: results.map(({ energy }) => computeMean(energy)),
    share: results.map(
      ({ food_eaten }) => food_eaten.filter((items) => items > 0).length / food_eaten.length,
    ),
  };
  return Object.fromEntries(
    Object.entries(measures).map(([name, values]) => [
      name,
      computeBand(values, quantiles, name === "share" ? 1 : Infinity),
    ]),
  );
}

/**
 * Return the mean of several values with its 95 % interval, which is between 0 and `upperLimit`.
 *
 * The interval can be negative if a value is negative.
 */
function computeBand(values, quantiles, upperLimit) {
  const mean = computeMean(values);
  if (values.length === 1) return { mean: [mean] };
  const spread = values.reduce((sum, value) => sum + (value - mean) ** 2, 0) / (values.length - 1);
  const half = Math.sqrt(spread / values.length) * quantiles[values.length];
  const low = values.some((value) => value < 0) ? mean - half : Math.max(0, mean - half);
  return { mean: [mean], low: [low], high: [Math.min(upperLimit, mean + half)], runs: [values] };
}
