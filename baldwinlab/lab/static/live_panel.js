/** The panel of a live run: progress, curves, world and controls. */

import { createRunSwitch } from "./chart_legend.js";
import { el, isServerless, postJSON, showMessage } from "./common.js";
import { LiveAlleles } from "./live_alleles.js";
import { LiveCurves } from "./live_curves.js";
import { LiveWorld } from "./live_world.js";
import { openSaveDialog } from "./save_dialog.js";

const STATES = {
  preparing: ["Preparing", ""],
  running: ["Running", "good"],
  paused: ["Paused", "warm"],
  done: ["Done", "good"],
  stopped: ["Stopped", ""],
  failed: ["Failed", "warm"],
  removed: ["Removed", "warm"],
};

/**
 * @param {HTMLElement} root is filled
 * @param {import("./live_feed.js").Feed} feed of a known run
 * @param {Object<string, string>} state of the address
 * @param {(patch: Object<string, any>, replace?: boolean) => void} navigate
 * @param {(summary: import("./live_feed.js").Feed["summary"]) => void} editRun called to
 *   change the run and start it again
 * @returns {{update: () => void, close: () => void}}
 */
export function createLivePanel(root, feed, state, navigate, editRun) {
  const { experiment, alleles, runs, seed } = feed.summary;
  const View = selectView(experiment, alleles);
  const world = View
    ? new View(feed.id, runs, state, navigate)
    : createEmptyWorld(experiment.model);
  const badge = el("span", { "data-testid": "live-state" });
  const progress = el("progress", { "aria-label": "Simulated generations" });
  const count = el("span", { class: "number", "data-testid": "live-count" });
  const fault = el("p", { class: "fault", hidden: true, "data-testid": "live-fault" });
  const buttons = createControls(feed, experiment, seed, editRun);
  const fitness = el("div", { "data-testid": "live-fitness" });
  const share = el("div", { "data-testid": "live-share" });
  const size = `${runs === 1 ? "1 run" : `${runs} runs`}, seed ${seed}`;
  root.replaceChildren(
    el(
      "section",
      { class: "card live-head", "data-testid": "live-head" },
      el(
        "div",
        { class: "row" },
        el("h1", {}, experiment.name),
        badge,
        el("span", { class: "soft" }, size),
        el("span", { class: "spread" }),
        ...buttons.elements,
      ),
      el("div", { class: "row live-progress" }, progress, count),
      fault,
    ),
    el(
      "div",
      { class: "live-both" },
      el(
        "div",
        { class: "live-curves" },
        el("section", { class: "card" }, fitness),
        el("section", { class: "card" }, share),
      ),
      world.element,
    ),
  );
  const runSwitch = createRunSwitch(state.lines === "each", (isChecked) => {
    navigate({ lines: isChecked ? "each" : null }, true);
    charts.update();
  });
  if (runs > 1) fitness.after(runSwitch);
  const charts = new LiveCurves(feed, fitness, share, runSwitch.firstChild, (generation, run) =>
    world.pick(generation, run),
  );

  const update = () => {
    const [word, kind] = STATES[feed.state];
    badge.className = `badge ${kind}`;
    badge.textContent = word;
    progress.max = experiment.evolution.generations;
    progress.value = feed.generationsDone;
    count.textContent =
      `${feed.generationsDone.toLocaleString("en")} of ` +
      `${experiment.evolution.generations.toLocaleString("en")} ` +
      "generations";
    fault.hidden = !feed.message;
    fault.textContent = feed.message;
    buttons.update();
    charts.update();
    world.setGenerationsDone(feed.generationsDone);
    if (feed.summary.saved_as) world.setSaved(feed.summary.saved_as, experiment.name);
  };
  update();
  return {
    update,
    close() {
      charts.close();
      world.close();
    },
  };
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
  return { element, pick: ignore, setGenerationsDone: ignore, setSaved: ignore, close: ignore };
}

/** Return the buttons of a run: pause, step, stop, save, and change. */
function createControls(feed, experiment, seed, editRun) {
  const pause = el("button", { type: "button", "data-testid": "pause" });
  const step = el(
    "button",
    {
      type: "button",
      hidden: true,
      title: "Simulate one more generation",
      "data-testid": "one-more",
      onclick: () => feed.send({ command: "step" }),
    },
    "Step",
  );
  const stop = el("button", { type: "button", class: "danger", "data-testid": "stop" }, "Stop");
  const save = el(
    "button",
    { type: "button", class: "primary", "data-testid": "save", hidden: true },
    "Save as a study …",
  );
  const change = el(
    "button",
    { type: "button", "data-testid": "again", onclick: () => editRun(feed.summary) },
    "Change and run again",
  );
  const openStudy = el(
    "a",
    { class: "button primary", "data-testid": "open-saved", hidden: true },
    "Open the study",
  );
  pause.addEventListener("click", () =>
    feed.send({ command: feed.state === "paused" ? "resume" : "pause" }),
  );
  stop.addEventListener("click", () => feed.send({ command: "stop" }));
  save.addEventListener("click", () =>
    openSaveDialog(
      `live/${experiment.name.replace(/[^A-Za-z0-9+_-]+/g, "-")}-${seed}`,
      async (name) => {
        feed.summary.saved_as = (await postJSON(`/api/live/${feed.id}/save`, { name })).study;
        showMessage(`Saved as the study ${feed.summary.saved_as}.`, "done");
        feed.onUpdate();
      },
    ),
  );
  const update = () => {
    pause.textContent = feed.state === "paused" ? "Resume" : "Pause";
    pause.hidden = stop.hidden = feed.ended;
    step.hidden = feed.ended || feed.state !== "paused" || !isServerless();
    save.hidden =
      isServerless() ||
      Boolean(feed.summary.saved_as) ||
      !["done", "stopped"].includes(feed.state) ||
      !feed.generationsDone;
    openStudy.hidden = !feed.summary.saved_as;
    if (feed.summary.saved_as)
      openStudy.href = `#/results?${new URLSearchParams({ study: feed.summary.saved_as })}`;
  };
  return { elements: [pause, step, stop, change, save, openStudy], update };
}
