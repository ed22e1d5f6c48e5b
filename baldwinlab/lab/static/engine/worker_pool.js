/** The workers of an exported page. */

import { inflate } from "../core/common.js";

const MAX_WORKERS = 16;

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
    return Math.min(navigator.hardwareConcurrency || 2, MAX_WORKERS);
  }

  /** Return a worker, by its number or name, that has loaded a compiled module. */
  async prepareWorker(name, program) {
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
  async warmUp(program, experiment) {
    const worker = await this.prepareWorker(0, program);
    await worker.request("warm", { program: program.name, experiment });
  }

  /** Simulate a run on the next worker. */
  async simulate(program, experiment, seed, run) {
    const worker = await this.prepareWorker(this.nextWorker++ % this.maxWorkers, program);
    return worker.request("simulate", { program: program.name, experiment, seed, run });
  }
}

/** The page's side of a worker: requests and their responses. */
class WorkerClient {
  constructor(worker) {
    this.worker = worker;
    this.waiting = new Map();
    this.programs = {};
    this.ticket = 0;
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

  request(command, parameters) {
    return new Promise((resolve, reject) => {
      this.waiting.set(++this.ticket, { resolve, reject });
      this.worker.postMessage({ ticket: this.ticket, command, parameters });
    });
  }
}
