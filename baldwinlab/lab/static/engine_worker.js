/** What a worker of a page without a server does: some runs of an experiment, and any life of them again. */

import { REFUSED, load } from "./engine.js";
import { Run, simulate } from "./simulation.js";
import { inspectAgent, spanOf, record } from "./lifetime_recorder.js";

const WARM_UP_TIME = 150; // ms
const CHUNK_STEPS = 100; // steps
const CHUNK_AGENT_STEPS = 200_000; // at a time
const YIELD_INTERVAL = 50; // ms, after which a worker hears what is asked of it
const MAX_GENOME_BYTES = 256_000_000; // bytes of genomes, in each worker

const loaded = new Map(); // programs, by the name of their module
const groups = new Map(); // runs that live side by side, by the page's name for them

const COMMANDS = {
  async program({ name, bytes, plan }) {
    loaded.set(name, await load(bytes, plan));
  },
  /** Live for a moment and forget it: browsers make what runs fast only when it has run for a while. */
  warm({ program, experiment }) {
    const run = new Run(loaded.get(program), experiment, 0, 0);
    const until = performance.now() + WARM_UP_TIME;
    run.startGeneration(0);
    for (
      let step = 0;
      step < experiment.lifetime.steps && performance.now() < until;
      step += CHUNK_STEPS
    )
      run.live(step, Math.min(step + CHUNK_STEPS, experiment.lifetime.steps));
  },
  begin({ group, program, experiment, seed, runs }) {
    const members = runs.map((run) => ({
      run,
      living: new Run(loaded.get(program), experiment, seed, run),
      genomes: [],
    }));
    groups.set(group, { made: members });
  },
  /** The next generation of each run of a group. */
  async next({ group }) {
    const state = groups.get(group);
    const { made: members } = state;
    const results = [];
    for (const { run, living, genomes } of members) {
      const { teachers } = living; // theirs who live now; those of their children stand there afterwards
      const { genome, ...lived } = await simulateInterruptibly(living, () => !state.stopped);
      genomes.push(genome);
      genomes[
        genomes.length - 1 - Math.floor(MAX_GENOME_BYTES / members.length / genome.byteLength)
      ] &&= null;
      results.push({ run, elders: teachers, ...lived });
    }
    return results;
  },
  genome({ group, run, generation }) {
    const genome = groups.get(group).made.find((entry) => entry.run === run).genomes[generation];
    if (!genome)
      throw new Error(
        `The genomes of generation ${generation} are no longer in memory. The page stores only the newest generations.`,
      );
    return genome;
  },
  recording: (shouldContinue) => replay(shouldContinue, record),
  inside: (shouldContinue) => replay(shouldContinue, inspectAgent),
  simulate: ({ program, experiment, seed, run }) =>
    simulate(loaded.get(program), experiment, seed, run),
  /** Live no further, in mid-life too; what has lived can still be seen. */
  stop({ group }) {
    groups.get(group).stopped = true;
  },
  end({ group }) {
    COMMANDS.stop({ group });
    groups.delete(group);
  },
};

/** The next generation of a run, which is left where it is as soon as it is not `wanted` any more. */
async function simulateInterruptibly(living, shouldContinue) {
  const {
    lifetime: { steps },
    population: { size },
  } = living.experiment;
  const piece = Math.max(1, Math.floor(CHUNK_AGENT_STEPS / size));
  const genome = living.startNext();
  let lastPause = performance.now();
  for (let step = 0; step < steps && shouldContinue(); step += piece) {
    living.live(step, Math.min(step + piece, steps));
    if (performance.now() - lastPause < YIELD_INTERVAL) continue;
    await new Promise((resolve) => setTimeout(resolve)); // let others be heard
    lastPause = performance.now();
  }
  return living.finishGeneration(genome);
}

/** A life again, from the genomes of its generation, with somebody who looks at it. */
function replay({ program, experiment, seed, run, genome, first, last, ...shouldContinue }, look) {
  const replayRun = new Run(loaded.get(program), experiment, seed, run);
  replayRun.engine.array("population.genome").set(genome);
  const part = spanOf(experiment, first, last);
  return {
    part,
    sizes: Array.from(replayRun.engine.array("setting.sizes"), Number),
    arrays: look(replayRun, { ...shouldContinue, ...part }),
  };
}

addEventListener("message", async ({ data: { ticket, command, parameters } }) => {
  try {
    const answer = await COMMANDS[command](parameters);
    postMessage({ ticket, answer });
  } catch (fault) {
    postMessage({ ticket, error: fault instanceof RangeError ? REFUSED : fault.message });
  }
});
