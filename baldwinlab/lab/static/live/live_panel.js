/** The panel of a live run: progress, curves, world and controls. */

import { createRunSwitch } from "../charts/chart_series.js";
import {
  createButton,
  createSelect,
  el,
  formatNumber,
  isServerless,
  postJSON,
  showMessage,
} from "../core/common.js";
import { openSaveDialog } from "../core/save_dialog.js";
import { LiveAlleles } from "./live_selector.js";
import {
  listEarlierRuns,
  LiveCurves,
  nameExperiment,
  rememberRun,
  STATISTICS,
} from "./live_curves.js";
import { showState } from "./live_feed.js";
import { LiveWorld } from "./live_world.js";

/** The panel of a run that the feed has described. */
export class LivePanel {
  /**
   * @param {HTMLElement} root is filled
   * @param {import("./live_feed.js").Feed} feed of a run with a summary
   * @param {Object<string, string>} state of the address
   * @param {(patch: Object<string, any>, replace?: boolean) => void} navigate
   * @param {(summary: import("./live_feed.js").Feed["summary"]) => void} editRun called to
   *   change the run and start it again
   */
  constructor(root, feed, state, navigate, editRun) {
    this.feed = feed;
    const { experiment, alleles, runs } = feed.summary;
    const { size, worlds = 1 } = experiment.population ?? {};
    const View = selectView(experiment, alleles);
    this.world = View
      ? new View(feed.id, runs, state, navigate, Math.floor(size / worlds))
      : createEmptyWorld(experiment.model);
    this.buttons = new RunButtons(feed, editRun);
    const fitness = el("div", { "data-testid": "live-fitness" });
    const share = el("div", { "data-testid": "live-share" });
    const counts = el("div", { "data-testid": "live-counts" });
    const charts = [fitness, share, counts];
    const cards = charts.map((chart) => el("section", { class: "card" }, chart));
    const curves = el("div", { class: "live-curves" }, cards);
    root.replaceChildren(
      this.createHead(),
      el("div", { class: "live-both" }, curves, this.world.element),
    );
    const runSwitch = createRunSwitch(state.lines === "each", (isChecked) => {
      navigate({ lines: isChecked ? "each" : null }, true);
      this.curves.update();
    });
    const drawCurves = (statistic) => {
      this.curves?.close();
      for (const chart of charts) chart.replaceChildren();
      this.curves = new LiveCurves(
        feed,
        fitness,
        share,
        counts,
        runSwitch.querySelector("input"),
        statistic,
        (generation, run) => this.world.showGeneration(generation, run),
        listEarlierRuns(),
      );
    };
    const statistic = createStatisticPicker(state.statistic, (chosen) => {
      navigate({ statistic: chosen === "mean" ? null : chosen }, true);
      drawCurves(chosen);
    });
    if (runs > 1) fitness.after(el("div", { class: "row" }, statistic, runSwitch));
    drawCurves(runs > 1 ? statistic.value : "mean");
    counts.closest("section").hidden = !counts.hasChildNodes();
    this.showName();
    this.update();
  }

  /** Return the card with the state, the buttons and the progress of the run. */
  createHead() {
    const { experiment, runs, seed } = this.feed.summary;
    const size = `${runs === 1 ? "1 run" : `${runs} runs`}, seed ${seed}`;
    this.heading = el("h1", {}, experiment.name);
    this.badge = el("span", { "data-testid": "live-state" });
    this.progress = el("progress", { "aria-label": "Simulated generations" });
    this.count = el("span", { class: "number", "data-testid": "live-count" });
    this.fault = el("p", { class: "fault", hidden: true, "data-testid": "live-fault" });
    return el(
      "section",
      { class: "card live-head", "data-testid": "live-head" },
      el(
        "div",
        { class: "row" },
        this.heading,
        this.badge,
        el("span", { class: "soft" }, size),
        el("span", { class: "spread" }),
        ...this.buttons.elements,
      ),
      el("div", { class: "row live-progress" }, this.progress, this.count),
      this.fault,
    );
  }

  /** Show the name with the changes of the preset. */
  async showName() {
    this.heading.textContent = await nameExperiment(this.feed.summary.experiment);
  }

  /** Show the current state of the feed. */
  update() {
    const { summary, state, message, generationsDone } = this.feed;
    const { name, evolution } = summary.experiment;
    showState(this.badge, state);
    this.progress.max = evolution.generations;
    this.progress.value = generationsDone;
    this.count.textContent = `${formatNumber(generationsDone)} of ` +
      `${formatNumber(evolution.generations)} generations`;
    this.fault.hidden = !message;
    this.fault.textContent = message;
    this.buttons.update();
    this.curves.update();
    this.world.setGenerationsDone(generationsDone);
    if (summary.saved_as) this.world.selector?.setSaved(summary.saved_as, name);
  }

  close() {
    const { bands, summary } = this.feed;
    if (!summary.species?.length)
      rememberRun(`${this.heading.textContent}, seed ${summary.seed}`, bands.mean.mean);
    this.curves.close();
    this.world.close();
  }
}

/** Return the list of what the curves of several runs show. */
function createStatisticPicker(initial, changed) {
  const options = Object.entries(STATISTICS).map(([value, { name }]) => [value, name]);
  return createSelect(options, initial, changed, {
    "aria-label": "Curves of several runs",
    "data-testid": "statistic",
  });
}

function selectView(experiment, alleles) {
  if (experiment.world) return LiveWorld;
  return alleles.length ? LiveAlleles : null;
}

/** Replace the world of a model without a world. */
function createEmptyWorld(model) {
  const element = el(
    "section",
    { class: "card", "data-testid": "live-no-world" },
    el("p", { class: "soft" }, `The model ${model} has no world to show.`),
  );
  const ignore = () => {};
  return {
    element,
    showGeneration: ignore,
    setGenerationsDone: ignore,
    selector: null,
    close: ignore,
  };
}

/** The buttons of a run: pause, step, stop, change, save, and open the study. */
class RunButtons {
  constructor(feed, editRun) {
    this.feed = feed;
    const pause = () => feed.send({ command: feed.state === "paused" ? "resume" : "pause" });
    this.pause = createButton("", pause, { "data-testid": "pause" });
    this.step = createButton("Step", () => feed.send({ command: "step" }), {
      hidden: true,
      title: "Simulate one more generation",
      "data-testid": "one-more",
    });
    this.stop = createButton("Stop", () => feed.send({ command: "stop" }), {
      class: "danger",
      "data-testid": "stop",
    });
    this.change = createButton("Change and run again", () => editRun(feed.summary), {
      "data-testid": "again",
    });
    this.save = createButton("Save as a study …", () => this.openSaveDialog(), {
      class: "primary",
      hidden: true,
      "data-testid": "save",
    });
    this.openStudy = el(
      "a",
      { class: "button primary", "data-testid": "open-saved", hidden: true },
      "Open the study",
    );
  }

  get elements() {
    return [this.pause, this.step, this.stop, this.change, this.save, this.openStudy];
  }

  openSaveDialog() {
    const { experiment, seed } = this.feed.summary;
    const initialName = `live/${experiment.name.replace(/[^A-Za-z0-9+_-]+/g, "-")}-${seed}`;
    openSaveDialog(
      "Save this run as a study",
      "Name of the study in the folder of this lab",
      initialName,
      (name) => this.saveStudy(name),
    );
  }

  async saveStudy(name) {
    const { feed } = this;
    feed.summary.saved_as = (await postJSON(`api/live/${feed.id}/save`, { name })).study;
    showMessage(`Saved as the study ${feed.summary.saved_as}.`, "done");
    feed.onUpdate();
  }

  update() {
    const { state, ended, generationsDone } = this.feed;
    const study = this.feed.summary.saved_as;
    const canBeSaved = ["done", "stopped"].includes(state) && generationsDone > 0 && !study;
    this.pause.textContent = state === "paused" ? "Resume" : "Pause";
    this.pause.hidden = this.stop.hidden = ended;
    // Only runs in the browser can simulate single generations.
    this.step.hidden = state !== "paused" || !isServerless();
    this.save.hidden = isServerless() || !canBeSaved;
    this.openStudy.hidden = !study;
    if (study) this.openStudy.href = `#/results?${new URLSearchParams({ study })}`;
  }
}
