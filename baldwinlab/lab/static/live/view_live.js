/** The Live run tab: settings on the left, the run on the right. */

import { getCurrentView } from "../core/address.js";
import { createMenu, el, getJSON, isServerless, showMessage } from "../core/common.js";
import { ComparePanel } from "./comparison_panel.js";
import { createFreezerButton } from "./freezer_panel.js";
import { openFeed } from "./live_feed.js";
import { LiveMap } from "./live_map.js";
import { LivePanel } from "./live_panel.js";
import { Setup } from "./live_setup.js";
import { createRunListButton, describeRun } from "./run_list.js";

// Removes the state of the previous run or comparison.
const EMPTY_STATE = {
  id: null,
  comparison: null,
  compare: null,
  run: null,
  generation: null,
  step: null,
  agent: null,
};

/**
 * Mount the view: show `state`, and report changes with `navigate` (see main.js). `opening`
 * replaces the map until the first run or change.
 * @param {import("./learning_contrast.js").LearningContrast|null} [opening]
 */
export function mount(root, state, navigate, guide, opening = null) {
  const view = new LiveView(root, state, navigate, guide, opening);
  view.update(state);
  return view;
}

class LiveView {
  constructor(root, state, navigate, guide, opening) {
    this.root = root;
    this.state = state;
    this.navigate = navigate;
    this.guide = guide;
    this.opening = opening;
    this.feed = null;
    this.panel = null;
    // The map of the settings, while no run is shown.
    this.map = null;
    // The id of the visible run or comparison, or "".
    this.shownId = null;
    this.aborted = new AbortController();
    this.stage = el("div", { class: "live-stage", "data-testid": "live-stage" });
    const side = el("div", { class: "live-side" });
    this.columns = el("div", { class: "live" }, this.stage, side);
    root.append(this.columns);
    const { signal } = this.aborted;
    this.setup = new Setup(state, navigate, this.createListener(), signal);
    if (!isServerless()) {
      const useFounders = (preset, file) => this.useFounders(preset, file);
      const items = [createRunListButton(signal), createFreezerButton(useFounders, signal)];
      this.setup.corner.append(createMenu("More", items, "live-more"));
    }
    this.setup.show(side).catch((error) => signal.aborted || showMessage(error.message, "error"));
  }

  /** Fill the form with a preset whose first generation has stored genomes. */
  useFounders(preset, { name, path }) {
    this.setup
      .loadPreset(preset, { "evolution.founders": [{ path, share: 1 }] })
      .then(() => showMessage(`${name} is the first generation. Press Start.`));
  }

  /** @returns {import("./live_setup.js").Listener} */
  createListener() {
    return {
      started: (id) => this.showStarted({ id }),
      compared: (comparison) => this.showStarted({ comparison }),
      paced: (seconds) => {
        if (this.feed && !this.feed.ended) this.feed.send({ command: "pace", seconds });
      },
      valid: (preview) => this.showPreview(preview),
    };
  }

  update(state) {
    this.state = state;
    const { id = "", comparison = "" } = state;
    if (id + comparison === this.shownId) return;
    this.shownId = id + comparison;
    this.columns.classList.toggle("shown", this.shownId !== "");
    this.leave();
    if (comparison) this.showComparison(comparison);
    else if (id) this.showRun(id);
    else if (this.opening) this.showOpening();
    else this.showQuestion();
  }

  showQuestion() {
    return this.showEmpty("Do agents evolve to find food?", this.guide.createDefinitionLink());
  }

  showOpening() {
    this.panel = this.opening;
    this.opening = null;
    this.stage.replaceChildren(this.panel.element);
    this.panel.start().catch((error) => showMessage(error.message, "error"));
  }

  /** Draw the map of the settings. It replaces the opening when the user changes a setting. */
  showPreview(preview) {
    const { set, preset } = getCurrentView().state;
    if (this.panel && !this.feed && (set || preset)) {
      this.leave();
      this.showQuestion();
    }
    this.map?.show(preview);
  }

  showComparison(name) {
    this.panel = new ComparePanel(
      this.stage,
      name,
      () =>
        this.showEmpty("This comparison has ended", "Its runs are stored. Open them in Results."),
    );
  }

  showRun(id) {
    this.feed = openFeed(id);
    this.feed.onUpdate = () => this.showUpdate();
    this.feed.onError = (sentence) => showMessage(sentence, "error");
    this.showUpdate();
  }

  /** Show the state of the feed. The panel is created when the feed has described the run. */
  showUpdate() {
    const { feed, stage, state, navigate } = this;
    if (this.panel) this.panel.update();
    else if (feed.summary)
      this.panel = new LivePanel(
        stage,
        feed,
        state,
        navigate,
        (summary) => this.setup.editRun(summary),
      );
    else if (feed.state === "removed") this.showEmpty("This live run has ended", feed.message);
  }

  showStarted(patch) {
    this.navigate({ ...EMPTY_STATE, ...patch }, false);
    // With one column, the run is above the settings.
    this.root.scrollTo({ top: 0 });
  }

  /** Show a message and the active runs if no run is selected. */
  async showEmpty(title, content) {
    const { signal } = this.aborted;
    const activeList = el("ul", { class: "live-active" });
    const showError = (error) => signal.aborted || showMessage(error.message, "error");
    this.map = new LiveMap(
      () => this.setup.fields.form.value,
      (change) => this.setup.edit(change).catch(showError),
    );
    this.stage.replaceChildren(
      el(
        "section",
        { class: "card empty", "data-testid": "live-empty" },
        el("h1", {}, title),
        this.map.element,
        el("p", {}, content),
        activeList,
      ),
    );
    const [{ runs }, { comparison }] = await Promise.all([
      getJSON("api/live", signal),
      getJSON("api/comparison", signal),
    ]);
    activeList.replaceChildren(
      ...(comparison ? [createComparisonLink(comparison)] : []),
      ...runs.map((run) => createLinkEntry(`#/live?id=${run.id}`, describeRun(run))),
    );
  }

  /** Close the panel of the visible run or comparison. */
  leave() {
    if (this.feed) {
      this.feed.onUpdate = () => {};
      this.feed.onError = () => {};
    }
    this.panel?.close();
    this.feed = null;
    this.panel = null;
    this.map = null;
  }

  unmount() {
    this.aborted.abort();
    this.leave();
  }
}

function createComparisonLink({ name, stored, runs, state }) {
  const address = `#/live?${new URLSearchParams({ comparison: name })}`;
  return createLinkEntry(address, `${name}, ${stored} of ${runs} runs, ${state}`);
}

function createLinkEntry(href, text) {
  return el("li", {}, el("a", { href }, text));
}
