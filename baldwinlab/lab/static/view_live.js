/** The Live run tab: settings on the left, the run on the right. */

import { el, getJSON, showMessage } from "./common.js";
import { openFeed } from "./live_feed.js";
import { createLivePanel } from "./live_panel.js";
import { Setup } from "./live_setup.js";
import { createSweepPanel } from "./sweep_panel.js";
import { WorldView } from "./world.js";

// Removes the state of the previous run or sweep.
const EMPTY_STATE = {
  id: null,
  sweep: null,
  fields: null,
  run: null,
  generation: null,
  step: null,
  agent: null,
};

/** Mount the view: show `state`, and report changes with `navigate` (see main.js). */
export function mount(root, state, navigate, guide) {
  const stage = el("div", { class: "live-stage", "data-testid": "live-stage" });
  const side = el("div", { class: "live-side" });
  const columns = el("div", { class: "live" }, side, stage);
  root.append(columns);
  const aborted = new AbortController();
  let feed = null;
  let panel = null;
  // The id of the visible run or sweep, or "".
  let shown = null;

  const leave = () => {
    if (feed) feed.onUpdate = feed.onError = () => {};
    panel?.close();
    feed = null;
    panel = null;
  };
  const showUpdate = () => {
    if (panel) panel.update();
    else if (feed.summary)
      panel = createLivePanel(stage, feed, state, navigate, (summary) => setup.editRun(summary));
    else if (feed.state === "removed")
      showEmpty(stage, "This live run has ended", feed.message, aborted.signal);
  };
  const update = (next) => {
    state = next;
    const { id = "", sweep = "" } = next;
    if (id + sweep === shown) return;
    shown = id + sweep;
    columns.classList.toggle("shown", shown !== "");
    leave();
    if (sweep)
      return void (panel = createSweepPanel(stage, sweep, () =>
        showEmpty(
          stage,
          "This sweep has ended",
          "Its runs are stored. Open them in Results.",
          aborted.signal,
        ),
      ));
    if (!id)
      return showEmpty(
        stage,
        "Watch evolution happen",
        "Choose a preset, change parameters if you like, and press Start.",
        aborted.signal,
      );
    feed = openFeed(id);
    feed.onUpdate = showUpdate;
    feed.onError = (sentence) => showMessage(sentence, "error");
    showUpdate();
  };
  const showStarted = (patch) => {
    // The run needs the space of the guide.
    guide.hide();
    navigate({ ...EMPTY_STATE, ...patch }, false);
    // With one column, the run is above the settings.
    root.scrollTo({ top: 0 });
  };
  const listener = {
    started: (id) => showStarted({ id }),
    swept: (sweep) => showStarted({ sweep }),
    paced: (seconds) => feed && !feed.ended && feed.send({ command: "pace", seconds }),
    valid: (shown) => drawPreview(stage, shown),
  };

  const setup = new Setup(state, navigate, listener, aborted.signal);
  setup.show(side).catch((error) => aborted.signal.aborted || showMessage(error.message, "error"));
  update(state);
  return {
    update,
    unmount() {
      aborted.abort();
      leave();
    },
  };
}

/** Show a message and the active runs if no run is selected. */
async function showEmpty(stage, title, sentence, signal) {
  const activeList = el("ul", { class: "live-active" });
  const map = el("canvas", {
    class: "live-preview",
    hidden: true,
    role: "img",
    "aria-label": "Map with the start area and the items",
  });
  stage.replaceChildren(
    el(
      "section",
      { class: "card empty", "data-testid": "live-empty" },
      el("h1", {}, title),
      el("p", {}, sentence),
      map,
      activeList,
    ),
  );
  const [{ runs }, { sweep }] = await Promise.all([
    getJSON("/api/live", signal),
    getJSON("/api/sweep", signal),
  ]);
  const sweepLinks = sweep
    ? [
        el(
          "li",
          {},
          el(
            "a",
            { href: `#/live?${new URLSearchParams({ sweep: sweep.name })}` },
            `${sweep.name}, ${sweep.stored} of ${sweep.runs} runs, ${sweep.state}`,
          ),
        ),
      ]
    : [];
  activeList.replaceChildren(
    ...sweepLinks,
    ...runs.map((run) =>
      el(
        "li",
        {},
        el(
          "a",
          { href: `#/live?id=${run.id}` },
          `${run.experiment.name}, ${run.generations_done} of ` +
            `${run.experiment.evolution.generations} generations, ${run.state}`,
        ),
      ),
    ),
  );
}

/** Draw the map of the selected settings if no run is selected. */
function drawPreview(stage, shown) {
  const map = stage.querySelector(".live-preview");
  if (!map) return;
  map.hidden = !shown.world;
  if (map.hidden) return;
  const view = new WorldView(map);
  view.show(shown);
  view.draw(null, 0);
}
