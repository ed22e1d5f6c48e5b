/** What a worker of a page without a server does: some runs of an experiment, and any life of them again. */

import { load } from "./engine.js";
import { Run, simulate } from "./lives.js";
import { lookInside, partOf, record } from "./looking.js";

const WARMING = 150; // ms
const PIECE = 100; // steps

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
    for (let step = 0; step < experiment.lifetime.steps && performance.now() < until; step += PIECE) run.live(step, Math.min(step + PIECE, experiment.lifetime.steps));
  },
  begin({ group, program, experiment, seed, runs }) {
    const made = runs.map((run) => ({ run, living: new Run(loaded.get(program), experiment, seed, run), genomes: [] }));
    groups.set(group, { program, experiment, seed, made });
  },
  /** The next generation of each run of a group. */
  next({ group }) {
    return groups.get(group).made.map(({ run, living, genomes }) => {
      const { genome, ...lived } = living.next();
      genomes.push(genome);
      return { run, ...lived };
    });
  },
  recording({ group, run, generation, look, first, last }) {
    const again = liveAgain(group, run, generation);
    const part = partOf(again.experiment, first, last);
    const sizes = Array.from(again.engine.array("setting.sizes"), Number);
    return { part, sizes, arrays: record(again, { generation, look, ...part }) };
  },
  inside({ group, run, generation, agent, look, first, last }) {
    const again = liveAgain(group, run, generation);
    const part = partOf(again.experiment, first, last);
    const sizes = Array.from(again.engine.array("setting.sizes"), Number);
    return { part, sizes, arrays: lookInside(again, { generation, look, agent, ...part }) };
  },
  simulate: ({ program, experiment, seed, run }) => simulate(loaded.get(program), experiment, seed, run),
  end({ group }) {
    groups.delete(group);
  },
};

/** A run in memory of its own, with the genomes of a generation. */
function liveAgain(group, run, generation) {
  const { program, experiment, seed, made } = groups.get(group);
  const again = new Run(loaded.get(program), experiment, seed, run);
  again.engine.array("population.genome").set(made.find((one) => one.run === run).genomes[generation]);
  return again;
}

addEventListener("message", async ({ data: { ticket, order, given } }) => {
  try {
    const answer = await ORDERS[order](given);
    postMessage({ ticket, answer });
  } catch (fault) {
    postMessage({ ticket, fault: fault.message });
  }
});
