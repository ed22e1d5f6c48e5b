/** The panel of a live run: progress, curves, world and controls. */

import { lineChart, seriesStyle, runSwitch } from "./charts.js";
import { el, message, postJSON, isServerless } from "./common.js";
import { LiveAlleles } from "./live_alleles.js";
import { LiveWorld } from "./live_world.js";
import { chartDownloads } from "./downloads.js";

const WORDS = {
  preparing: ["Preparing", ""],
  running: ["Running", "good"],
  paused: ["Paused", "warm"],
  done: ["Done", "good"],
  stopped: ["Stopped", ""],
  failed: ["Failed", "warm"],
  gone: ["Gone", "warm"],
};

/**
 * @param {HTMLElement} root is filled
 * @param {import("./live_feed.js").Feed} feed of a known run
 * @param {Object<string, string>} state of the address
 * @param {(patch: Object<string, any>, replace?: boolean) => void} navigate
 * @param {(summary: import("./live_feed.js").Feed["summary"]) => void} editRun called to change the run
 *   and start it again
 * @returns {{update: () => void, close: () => void}}
 */
export function livePanel(root, feed, state, navigate, editRun) {
  const { experiment, alleles, runs, seed } = feed.summary;
  const Lives = experiment.world ? LiveWorld : alleles.length ? LiveAlleles : null;
  const world = Lives ? new Lives(feed.id, runs, state, navigate) : emptyWorld(experiment.model);
  const [badge, progress] = [
    el("span", { "data-testid": "live-state" }),
    el("progress", { "aria-label": "Simulated generations" }),
  ];
  const [count, fault] = [
    el("span", { class: "number", "data-testid": "live-count" }),
    el("p", { class: "fault", hidden: true, "data-testid": "live-fault" }),
  ];
  const buttons = controls(feed, experiment, seed, editRun);
  const [fitness, share] = [
    el("div", { "data-testid": "live-fitness" }),
    el("div", { "data-testid": "live-share" }),
  ];
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
  const eachRun = runSwitch(state.lines === "each", (each) => {
    navigate({ lines: each ? "each" : null }, true);
    charts.update();
  });
  if (runs > 1) fitness.after(eachRun);
  const charts = curves(feed, fitness, share, eachRun.firstChild, (generation, run) =>
    world.pick(generation, run),
  );

  const update = () => {
    const [word, kind] = WORDS[feed.state];
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

/** Replace the world of a model without a world. */
function emptyWorld(model) {
  const element = el(
    "section",
    { class: "card", "data-testid": "live-no-world" },
    el("p", { class: "soft" }, `The model ${model} has no world to show.`),
  );
  const nothing = () => {};
  return { element, pick: nothing, setGenerationsDone: nothing, setSaved: nothing, close: nothing };
}

/** Draw fitness and the share of agents that eat. A click on a curve shows that generation. */
function curves(feed, fitness, share, eachRun, pick) {
  const {
    runs,
    experiment: { world: worlds },
  } = feed.summary;
  const x = Array.from(
    { length: feed.summary.experiment.evolution.generations },
    (_, generation) => generation,
  );
  // The axis covers all generations from the start.
  const padded = (values) => values && x.map((generation) => values[generation] ?? null);
  const band = (label, name, number) => {
    const { mean, low, high, runs: runValues } = feed.bands[name];
    const runLines = Array.from({ length: eachRun.checked ? runs : 0 }, (_, run) => ({
      run,
      values: padded((runValues ?? []).map((values) => values[run])),
    }));
    return {
      label,
      color: seriesStyle(number).color,
      values: padded(mean),
      low: padded(low),
      high: padded(high),
      runs: runLines,
    };
  };
  const lines = () => [band("best agent", "best", 0), band("average agent", "mean", 1)];
  const shares = () => [band(worlds ? "share of agents that eat" : "share above 0", "share", 2)];
  const options = { x, xLabel: "generation", height: 210, onPick: ({ x, run }) => pick(x, run) };
  const suffix = runs > 1 ? `, mean of ${runs} runs with 95 % interval` : "";
  const chart = (root, name, more, shown) => {
    const plot = el("div");
    const chart = lineChart(plot, { ...options, ...more, series: shown() });
    const rows = () =>
      shown().flatMap(({ label, values, low, high }) =>
        x.slice(0, feed.generationsDone).map((generation) => ({
          curve: label,
          generation,
          mean: values[generation],
          low: low?.[generation],
          high: high?.[generation],
        })),
      );
    root.append(
      plot,
      chartDownloads(name, ["curve", "generation", "mean", "low", "high"], rows, chart.svg),
    );
    return chart;
  };
  const charts = [
    chart(
      fitness,
      "fitness",
      { title: `Fitness${suffix}`, yLabel: worlds ? "fitness (energy)" : "fitness" },
      lines,
    ),
    chart(
      share,
      "share",
      {
        title: worlds ? "Share of agents that eat" : "Share of agents with fitness above 0",
        yLabel: "share",
        height: 150,
      },
      shares,
    ),
  ];
  let drawn = 0;
  const draw = () => {
    drawn = 0;
    charts[0].update(x, lines());
    charts[1].update(x, shares());
  };
  return {
    // Draw once per frame, independent of the number of messages.
    update: () => (drawn ||= requestAnimationFrame(draw)),
    close() {
      cancelAnimationFrame(drawn);
      for (const chart of charts) chart.destroy();
    },
  };
}

/** Return the buttons of a run: pause, step, stop, save, and change. */
function controls(feed, experiment, seed, editRun) {
  const pause = el("button", { type: "button", "data-testid": "pause" });
  const step = el(
    "button",
    {
      type: "button",
      hidden: true,
      title: "Simulate one more generation",
      "data-testid": "one-more",
      onclick: () => feed.send({ do: "step" }),
    },
    "Step",
  );
  const stop = el("button", { type: "button", class: "danger", "data-testid": "stop" }, "Stop");
  const keep = el(
    "button",
    { type: "button", class: "primary", "data-testid": "keep", hidden: true },
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
    feed.send({ do: feed.state === "paused" ? "resume" : "pause" }),
  );
  stop.addEventListener("click", () => feed.send({ do: "stop" }));
  keep.addEventListener("click", () =>
    saveDialog(
      `live/${experiment.name.replace(/[^A-Za-z0-9+_-]+/g, "-")}-${seed}`,
      async (name) => {
        feed.summary.saved_as = (await postJSON(`/api/live/${feed.id}/save`, { name })).study;
        message(`Saved as the study ${feed.summary.saved_as}.`, "done");
        feed.onUpdate();
      },
    ),
  );
  const update = () => {
    pause.textContent = feed.state === "paused" ? "Resume" : "Pause";
    pause.hidden = stop.hidden = feed.ended;
    step.hidden = feed.ended || feed.state !== "paused" || !isServerless();
    keep.hidden =
      isServerless() ||
      Boolean(feed.summary.saved_as) ||
      !["done", "stopped"].includes(feed.state) ||
      !feed.generationsDone;
    openStudy.hidden = !feed.summary.saved_as;
    if (feed.summary.saved_as)
      openStudy.href = `#/results?${new URLSearchParams({ study: feed.summary.saved_as })}`;
  };
  return { elements: [pause, step, stop, change, keep, openStudy], update };
}

/** Open a dialog that asks for the name of a study until `keep` succeeds. */
function saveDialog(initialName, keep) {
  const name = el("input", {
    value: initialName,
    spellcheck: "false",
    maxlength: 100,
    "data-testid": "keep-name",
  });
  const fault = el("p", {
    class: "fault",
    hidden: true,
    role: "alert",
    "data-testid": "keep-fault",
  });
  const done = el("button", { type: "submit", class: "primary", "data-testid": "keep-do" }, "Save");
  const cancel = el(
    "button",
    { type: "button", class: "quiet", onclick: () => dialog.close() },
    "Cancel",
  );
  const form = el(
    "form",
    { class: "live-keep" },
    el("h2", {}, "Save this run as a study"),
    el(
      "label",
      { class: "field" },
      el("span", {}, "Name of the study in the folder of this lab"),
      name,
    ),
    fault,
    el("div", { class: "row" }, el("span", { class: "spread" }), cancel, done),
  );
  const dialog = el("dialog", {}, form);
  form.addEventListener("submit", async (event) => {
    event.preventDefault();
    done.disabled = true;
    try {
      await keep(name.value.trim());
      dialog.close();
    } catch (refusal) {
      fault.textContent = refusal.message;
      fault.hidden = false;
    }
    done.disabled = false;
  });
  dialog.addEventListener("close", () => dialog.remove());
  document.body.append(dialog);
  dialog.showModal();
  name.select();
}
