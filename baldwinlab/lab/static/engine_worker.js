/** What a worker of a page without a server does: some runs of an experiment, and any life of them again. */

import { REFUSED, load } from "./engine.js";
import { Run, simulate } from "./simulation.js";
import { inspectAgent, spanOf, record } from "./lifetime_recorder.js";

const WARMING = 150; // ms
const PIECE = 100; // steps
const AGENT_STEPS = 200_000; // at a time
const LISTENS = 50; // ms, after which a worker hears what is asked of it
const MOST_KEPT = 256_000_000; // bytes of genomes, in each worker

const loaded = new Map(); // programs, by the name of their module
const groups = new Map(); // runs that live side by side, by the page's name for them

const ORDERS = {
  async program({ name, bytes, plan }) {
    loaded.set(name, await load(bytes, plan));
  },
  /** Live for a moment and forget it: browsers make what runs fast only when it has run for a while. */
  warm({ program, experiment }) {
    const run = new Run(loaded.get(program), experiment, 0, 0);
    const until = performance.now() + WARMING;
    run.bear(0);
    for (let step = 0; step < experiment.lifetime.steps && performance.now() < until; step += PIECE)
      run.live(step, Math.min(step + PIECE, experiment.lifetime.steps));
  },
  begin({ group, program, experiment, seed, runs }) {
    const made = runs.map((run) => ({
      run,
      living: new Run(loaded.get(program), experiment, seed, run),
      genomes: [],
    }));
    groups.set(group, { made });
  },
  /** The next generation of each run of a group. */
  async next({ group }) {
    const whole = groups.get(group);
    const { made } = whole;
    const all = [];
    for (const { run, living, genomes } of made) {
      const { elders } = living; // theirs who live now; those of their children stand there afterwards
      const { genome, ...lived } = await livedInPieces(living, () => !whole.stopped);
      genomes.push(genome);
      genomes[genomes.length - 1 - Math.floor(MOST_KEPT / made.length / genome.byteLength)] &&=
        null;
      all.push({ run, elders, ...lived });
    }
    return all;
  },
  genome({ group, run, generation }) {
    const found = groups.get(group).made.find((one) => one.run === run).genomes[generation];
    if (!found)
      throw new Error(
        `The genomes of generation ${generation} are no longer in memory. The page stores only the newest generations.`,
      );
    return found;
  },
  recording: (wanted) => looked(wanted, record),
  inside: (wanted) => looked(wanted, inspectAgent),
  simulate: ({ program, experiment, seed, run }) =>
    simulate(loaded.get(program), experiment, seed, run),
  /** Live no further, in mid-life too; what has lived can still be seen. */
  stop({ group }) {
    groups.get(group).stopped = true;
  },
  end({ group }) {
    ORDERS.stop({ group });
    groups.delete(group);
  },
};

/** The next generation of a run, which is left where it is as soon as it is not `wanted` any more. */
async function livedInPieces(living, wanted) {
  const {
    lifetime: { steps },
    population: { size },
  } = living.experiment;
  const piece = Math.max(1, Math.floor(AGENT_STEPS / size));
  const genome = living.begin();
  let since = performance.now();
  for (let step = 0; step < steps && wanted(); step += piece) {
    living.live(step, Math.min(step + piece, steps));
    if (performance.now() - since < LISTENS) continue;
    await new Promise((resolve) => setTimeout(resolve)); // let others be heard
    since = performance.now();
  }
  return living.end(genome);
}

/** A life again, from the genomes of its generation, with somebody who looks at it. */
function looked({ program, experiment, seed, run, genome, first, last, ...wanted }, look) {
  const again = new Run(loaded.get(program), experiment, seed, run);
  again.engine.array("population.genome").set(genome);
  const part = spanOf(experiment, first, last);
  return {
    part,
    sizes: Array.from(again.engine.array("setting.sizes"), Number),
    arrays: look(again, { ...wanted, ...part }),
  };
}

addEventListener("message", async ({ data: { ticket, order, given } }) => {
  try {
    const answer = await ORDERS[order](given);
    postMessage({ ticket, answer });
  } catch (fault) {
    postMessage({ ticket, fault: fault instanceof RangeError ? REFUSED : fault.message });
  }
});
