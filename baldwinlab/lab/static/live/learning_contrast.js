/** The opening of an exported page: agents that learn next to agents that cannot, playing. */

import { el } from "../core/common.js";
import { applyChanges } from "../core/experiment_changes.js";
import { Lead } from "../world/lead.js";
import { chooseSpeed } from "../world/player.js";
import { matchProgram } from "../engine/program_table.js";
import { Recording } from "../world/recording.js";
import { addFigure } from "../world/world_figure.js";
import { WorldGroup } from "../world/world_group.js";

const LABELS = ["With learning", "Without learning"];

// The typical one of these runs is shown.
const RUNS = 3;
// Evolution of both populations takes less than a second.
const MAX_GENERATIONS = 10;
const MAX_AGENT_STEPS = 10_000_000;
const NO_LEARNING = { "learning.rule": "none" };

/**
 * Return the experiments of a contrast: with the learning rule, and without. Return null if the
 * page cannot simulate them in a second.
 * @param {import("../engine/browser_lab.js").BrowserLab} lab
 */
export function createContrast(lab, experiment) {
  const { population, lifetime, evolution, learning } = experiment;
  const generations = Math.min(
    MAX_GENERATIONS,
    evolution.generations,
    Math.floor(MAX_AGENT_STEPS / (RUNS * population.size * lifetime.steps)),
  );
  if (generations < 1 || learning.rule === "none") return null;
  const learners = applyChanges(experiment, { "evolution.generations": generations });
  const controls = applyChanges(learners, NO_LEARNING);
  const canSimulate = lab.findErrors(controls).length === 0 &&
    matchProgram(lab.laboratory.programs, controls);
  return canSimulate ? [learners, controls] : null;
}

export class LearningContrast extends WorldGroup {
  /**
   * @param {import("../engine/browser_lab.js").BrowserLab} lab
   * @param {object[]} experiments the result of `createContrast`
   * @param {number} seed
   * @param {import("../core/guide.js").Guide} guide
   */
  constructor(lab, experiments, seed, guide) {
    super("contrast-");
    this.lab = lab;
    this.experiments = experiments;
    this.seed = seed;
    this.feeds = [];
    const figures = LABELS.map((label, index) => addFigure(this, label, `contrast-${"ab"[index]}`));
    this.lead = new Lead(guide, () => {});
    // Whether the lifetime plays when it comes in sight.
    this.resumes = true;
    this.sight = new IntersectionObserver((entries) =>
      this.setInSight(entries.at(-1).isIntersecting)
    );
    this.element = el(
      "section",
      { class: "card contrast", "data-testid": "contrast" },
      this.lead.root,
      el("div", { class: "contrast-worlds" }, figures.map(createWorld)),
      this.bar.createRow(),
    );
  }

  get panels() {
    return this.maps.map(({ life }, index) => ({
      source: { condition: LABELS[index], generation: life.header.generation },
      life,
    }));
  }

  /** Simulate both populations, and play the lifetime of their last generation. */
  async start() {
    const feeds = await Promise.all(
      this.experiments.map((experiment) => this.simulate(experiment)),
    );
    const run = findTypicalRun(feeds[0]);
    const recordings = await Promise.all(feeds.map((feed) => loadLastGeneration(feed, run)));
    if (this.leaving.signal.aborted) return;
    this.showRecordings(recordings);
    this.player.setSpeed(chooseSpeed(recordings[0].steps));
    this.lead.ask(this.panels);
    const { generation } = recordings[0].header;
    this.lead.note.textContent = `Generation ${generation}, typical run.`;
    this.lead.startBefore(findFirstMeal(recordings), this.player);
    this.sight.observe(this.element);
  }

  /** Pause while out of sight. */
  setInSight(isInSight) {
    const { player } = this;
    if (isInSight) {
      if (this.resumes) player.autoplay();
      this.resumes = false;
    } else if (player.playing) {
      player.pause();
      this.resumes = true;
    }
  }

  /** Return the feed of finished runs. */
  async simulate(experiment) {
    const order = { experiment, runs: RUNS, seed: this.seed, seconds: 0 };
    const { id } = await this.lab.post("api/live", order);
    const feed = this.lab.openFeed(id);
    this.feeds.push(feed);
    await new Promise((resolve, reject) => {
      feed.onUpdate = () => {
        if (feed.state === "done") resolve();
        else if (feed.ended) reject(new Error(feed.message));
      };
    });
    return feed;
  }

  close() {
    super.close();
    this.sight.disconnect();
    for (const feed of this.feeds) feed.close();
  }
}

function createWorld({ stage, note }, index) {
  const caption = el("figcaption", {}, el("strong", {}, LABELS[index]), " · ", note);
  return el("figure", {}, stage, caption);
}

/** Return the first step at which an agent eats, or Infinity. */
function findFirstMeal(recordings) {
  const steps = recordings.map(({ meals }) => meals.findIndex((count) => count > 0));
  return Math.min(...steps.map((step) => (step < 0 ? Infinity : step)));
}

/** Return the run whose mean fitness in the last generation is the median. */
function findTypicalRun(feed) {
  const means = feed.bands.mean.runs.at(-1);
  const order = means.map((_, run) => run).sort((first, second) => means[first] - means[second]);
  return order[Math.floor(order.length / 2)];
}

async function loadLastGeneration(feed, run) {
  const query = { run, generation: feed.generationsDone - 1 };
  return new Recording(await feed.loadRecording(query));
}
