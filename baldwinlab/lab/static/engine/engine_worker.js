/** The worker of an exported page: simulate runs, and replay lifetimes. */

import { compileProgram, MEMORY_ERROR } from "./engine.js";
import { Run, simulate } from "./simulation.js";
import { WorldCursor } from "./frame_recorder.js";
import { limitSpan, recordLifetime } from "./lifetime_recorder.js";

// Milliseconds of simulation before the first run.
const WARM_UP_TIME = 150;
// Steps between two checks of the time.
const CHUNK_STEPS = 100;
// Agent-steps between two checks.
const CHUNK_AGENT_STEPS = 200_000;
// Milliseconds, after which a worker handles messages.
const YIELD_INTERVAL = 50;
// Bytes of genomes in each worker.
const MAX_GENOME_BYTES = 256_000_000;

// Compiled modules, by name.
const programs = new Map();
// Runs that are simulated together, by the name that the page gives them.
const groups = new Map();
// The cursor of the last frames, and the name of its lifetime.
let frames = { life: "", cursor: null };

const COMMANDS = {
  async program({ name, bytes, plan }) {
    programs.set(name, await compileProgram(bytes, plan));
  },
  /**
   * Simulate for a moment and discard the result, because browsers optimize code that runs often.
   */
  warm({ program, experiment }) {
    const run = new Run(programs.get(program), experiment, 0, 0);
    const endTime = performance.now() + WARM_UP_TIME;
    run.startGeneration(0);
    for (
      let step = 0;
      step < experiment.lifetime.steps && performance.now() < endTime;
      step += CHUNK_STEPS
    )
      run.simulateSteps(step, Math.min(step + CHUNK_STEPS, experiment.lifetime.steps));
  },
  begin({ group, program, experiment, seed, runs }) {
    const members = runs.map((run) => ({
      run,
      simulation: new Run(programs.get(program), experiment, seed, run),
      genomes: [],
    }));
    groups.set(group, { members });
  },
  /** Continue the runs of a group with other settings, as another group. */
  fork({ group, source, program, experiment, seed }) {
    const members = groups.get(source).members.map(({ run, simulation, genomes }) => {
      const fork = new Run(programs.get(program), experiment, seed, run);
      fork.continueFrom(simulation);
      return { run, simulation: fork, genomes: [...genomes] };
    });
    groups.set(group, { members });
  },
  /** Simulate the next generation of each run of a group. */
  async next({ group }) {
    const state = groups.get(group);
    const { members } = state;
    const results = [];
    for (const { run, simulation, genomes } of members) {
      const { genome, ...outcome } = await simulateInterruptibly(simulation, () => !state.stopped);
      genomes.push(genome);
      genomes[
        genomes.length - 1 - Math.floor(MAX_GENOME_BYTES / members.length / genome.byteLength)
      ] &&= null;
      results.push({ run, ...outcome });
    }
    return results;
  },
  genome({ group, run, generation }) {
    const genome = groups.get(group).members.find((entry) => entry.run === run).genomes[generation];
    if (!genome)
      throw new Error(
        `The genomes of generation ${generation} are no longer in memory. The page ` +
          "stores only the newest generations.",
      );
    return genome;
  },
  recording: recordAgain,
  /**
   * Return frames of a lifetime, or null if the genomes are needed. Genomes have megabytes, so only
   * the first request of a lifetime contains them.
   */
  frames({ life, program, experiment, seed, run, generation, genome, query, kindSizes }) {
    if (frames.life !== life) {
      if (!genome) return null;
      const frameRun = new Run(programs.get(program), experiment, seed, run);
      frameRun.engine.array("population.genome").set(genome);
      frames = { life, cursor: new WorldCursor(frameRun, generation) };
    }
    return frames.cursor.makeFrames(query, kindSizes);
  },
  simulate: ({ program, experiment, seed, run }) =>
    simulate(programs.get(program), experiment, seed, run),
  /** Stop a group within a lifetime. Finished generations remain available. */
  stop({ group }) {
    groups.get(group).stopped = true;
  },
  end({ group }) {
    COMMANDS.stop({ group });
    groups.delete(group);
  },
};

/** Simulate the next generation of a run. Stop as soon as `shouldContinue` returns false. */
async function simulateInterruptibly(simulation, shouldContinue) {
  const {
    lifetime: { steps },
    population: { size },
  } = simulation.experiment;
  const chunkSteps = Math.max(1, Math.floor(CHUNK_AGENT_STEPS / size));
  const genome = simulation.startNext();
  let lastPause = performance.now();
  for (let step = 0; step < steps && shouldContinue(); step += chunkSteps) {
    simulation.simulateSteps(step, Math.min(step + chunkSteps, steps));
    if (performance.now() - lastPause < YIELD_INTERVAL) continue;
    // Let the worker handle messages.
    await new Promise((resolve) => setTimeout(resolve));
    lastPause = performance.now();
  }
  return simulation.finishGeneration(genome);
}

/** Simulate a lifetime again from the genomes of its generation, and record it. */
function recordAgain(
  { program, experiment, seed, run, generation, genome, appearance, first, last },
) {
  const replayRun = new Run(programs.get(program), experiment, seed, run);
  replayRun.engine.array("population.genome").set(genome);
  const part = limitSpan(experiment, first, last);
  return { part, arrays: recordLifetime(replayRun, { generation, appearance, ...part }) };
}

addEventListener("message", async ({ data: { ticket, command, parameters } }) => {
  try {
    const answer = await COMMANDS[command](parameters);
    postMessage({ ticket, answer });
  } catch (error) {
    postMessage({ ticket, error: error instanceof RangeError ? MEMORY_ERROR : error.message });
  }
});
