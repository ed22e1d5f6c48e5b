/**
 * Replace the lab's server on an exported page: experiments, validation and live runs on workers.
 */

import { validateTree } from "./validation.js";
import { BrowserFeed } from "./browser_runs.js";
import { fillTemplate, findProgram, isTable } from "./program_table.js";
import { WorkerPool } from "./worker_pool.js";
import { applyChanges, findChanges } from "../core/experiment_changes.js";

/**
 * @typedef {object} Laboratory the data that Python writes into the page
 * @property {{name: string, description: string, experiment: object, schema: number,
 *   appearance: object,
 *   topics: import("../core/guide.js").Topic[], measures: object}[]} presets
 * @property {object[]} schemas
 * @property {{name: string, when: Object<string, any>, module: string, plan: object}[]} programs
 * @property {object[]} rules
 * @property {number} seed
 * @property {number[]} quantiles of Student's t, by the number of runs
 */
export class BrowserLab {
  /**
   * @param {Laboratory} laboratory
   * @param {string} code of a worker
   */
  constructor(laboratory, code) {
    this.laboratory = laboratory;
    this.workers = new WorkerPool(code, laboratory.programs);
    this.feeds = new Map();
    const { experiment } = laboratory.presets[0];
    // The start of a run reports the error.
    this.workers.warmUp(this.findProgram(experiment), experiment).catch(() => {});
  }

  async get(path) {
    const { pathname, searchParams } = new URL(path, "http://page/");
    const parameters = Object.fromEntries(searchParams);
    const { presets } = this.laboratory;
    if (pathname === "/api/presets")
      return {
        presets: presets.map(({ name, description }) => ({ name, description })),
        default: presets[0].name,
      };
    if (pathname === "/api/preset")
      return structuredClone(this.findPreset(parameters.name).experiment);
    if (pathname === "/api/live") return { runs: [] };
    if (pathname === "/api/comparison") return { comparison: null };
    const feed = this.feeds.get(parameters.live);
    const names = ["run", "generation", "first", "last"].filter((name) => name in parameters);
    const numbers = Object.fromEntries(names.map((name) => [name, Number(parameters[name])]));
    return pathname === "/api/frames"
      ? feed.loadFrames(parameters, numbers)
      : feed.loadRecording(numbers);
  }

  async post(path, { experiment, ...request }) {
    if (path === "api/schema")
      return { schema: this.findSchema(experiment), experiment };
    if (path === "api/validate")
      return { errors: [...this.findErrors(experiment), ...validateTree(ORDER, request, [])] };
    if (path === "api/appearance")
      return { world: experiment.world, appearance: this.describeAppearance(experiment) };
    const preset = this.findPreset(experiment.name);
    // Distinguishes the ids of equal runs.
    const suffix = Math.random().toString(36).slice(2, 6);
    return {
      id: encodeId({
        preset: preset.name,
        changes: findChanges(experiment, preset.experiment),
        ...request,
        turn: suffix,
      }),
    };
  }

  /** Open the feed of a live run from its id. */
  openFeed(id) {
    const feed = new BrowserFeed(id, this, this.parseOrder(decodeId(id)));
    this.feeds.set(id, feed);
    return feed;
  }

  /** Return the order in an id, or null if the id is damaged. */
  parseOrder(parameters) {
    const preset = this.laboratory.presets.find(({ name }) => name === parameters?.preset);
    if (
      !preset ||
      validateTree(
        ORDER,
        { runs: parameters.runs, seed: parameters.seed, seconds: parameters.seconds },
        [],
      ).length
    )
      return null;
    return { ...parameters, experiment: applyChanges(preset.experiment, parameters.changes ?? {}) };
  }

  findPreset(name) {
    const { presets } = this.laboratory;
    return presets.find((preset) => preset.name === name) ?? presets[0];
  }

  findSchema(experiment) {
    return this.laboratory.schemas[this.findPreset(experiment.name).schema];
  }

  findErrors(experiment) {
    return validateTree(this.findSchema(experiment), experiment, this.laboratory.rules);
  }

  /**
   * Return the compiled module for an experiment. Throw an Error if the page does not contain it.
   */
  findProgram(experiment) {
    return findProgram(this.laboratory.programs, experiment);
  }

  /** Return the appearance of the world of an experiment. */
  describeAppearance(experiment) {
    return fillTemplate(this.findPreset(experiment.name).appearance, experiment);
  }

  /** For scripts: simulate a run, bit-identical to `bl.simulate`. Rejects with a message. */
  async simulate({ seed, run = 0, generations, experiment = /** @type {any} */ ({}) }) {
    const base = this.findPreset(experiment.name).experiment;
    const length = generations === undefined ? {} : { evolution: { generations } };
    const completed = mergeTables(mergeTables(base, experiment), length);
    const errors = [...validateTree(ORDER, { seed, run }, []), ...this.findErrors(completed)];
    if (errors.length) throw new Error(errors.map(({ message }) => message).join("\n"));
    return this.workers.simulate(this.findProgram(completed), completed, seed, run);
  }
}

const INTEGER = { type: "integer", minimum: 0, maximum: 2 ** 31 - 1 };
const ORDER = {
  properties: {
    seed: INTEGER,
    run: INTEGER,
    runs: { ...INTEGER, minimum: 1, maximum: 50 },
    seconds: { type: "number" },
  },
};

/** Merge a tree into another, table by table. Lists are replaced. */
function mergeTables(base, changes) {
  if (!isTable(base) || !isTable(changes)) return structuredClone(changes);
  const names = new Set([...Object.keys(base), ...Object.keys(changes)]);
  return Object.fromEntries(
    [...names].map((name) => [
      name,
      name in changes ? mergeTables(base[name], changes[name]) : structuredClone(base[name]),
    ]),
  );
}

/** Return an order as an id for the address. */
function encodeId(request) {
  const bytes = new TextEncoder().encode(JSON.stringify(request));
  return btoa(String.fromCharCode(...bytes)).replace(
    /[+/=]/g,
    (letter) => ({ "+": "-", "/": "_", "=": "" })[letter],
  );
}

/** Return the order in an id, or null if the id is damaged. */
function decodeId(id) {
  try {
    const text = atob(id.replace(/[-_]/g, (letter) => ({ "-": "+", _: "/" })[letter]));
    return JSON.parse(
      new TextDecoder().decode(Uint8Array.from(text, (letter) => letter.charCodeAt(0))),
    );
  } catch {
    return null;
  }
}
