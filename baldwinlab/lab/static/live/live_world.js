/** The world of a live run: the newest generation, or a selected one. */

import { el, formatNumber, showMessage } from "../core/common.js";
import { Legend } from "../world/legend.js";
import { openLifetime } from "../world/lifetimes.js";
import { LiveSelector, parseWholeNumber } from "./live_selector.js";
import { mountShare } from "../share/share.js";
import { addFigure } from "../world/world_figure.js";
import { WorldGroup } from "../world/world_group.js";

// Milliseconds that a generation is shown before a newer one replaces it.
const MIN_DISPLAY_TIME = 1000;

const DEFAULT_SPEED = 100;

/** @type {typeof import("../inspector/inspector.js").Inspector|null} */
let Inspector = null;

/** Set the agent inspector of all live runs. An exported page has none. */
export function setInspector(inspector) {
  Inspector = inspector;
}

export class LiveWorld extends WorldGroup {
  /**
   * @param {string} id of the live run
   * @param {number} runs
   * @param {Object<string, string>} state of the address: speed, run, generation (by default the
   *   newest), step, agent
   * @param {(patch: Object<string, any>) => void} navigate
   * @param {number} agents of the world
   */
  constructor(id, runs, state, navigate, agents) {
    super("live-", Inspector);
    this.agents = agents;
    this.navigate = navigate;
    this.displayStart = 0;
    this.newestTimer = 0;
    this.share = null;
    // The step of the next lifetime, or null for the current time.
    this.startAt = parseWholeNumber(state.step) ?? 0;
    this.selector = new LiveSelector(
      id,
      runs,
      state,
      (generation, run) => this.showGeneration(generation, run),
    );
    this.map = addFigure(this, "World of the generation shown", "live-canvas", {
      loaded: () => this.loaded(),
      failed: (error) => showMessage(error.message, "error"),
    });
    this.map.agent = parseWholeNumber(state.agent);
    this.player.setSpeed(Number(state.speed) || DEFAULT_SPEED);
    this.legend = new Legend();
    this.inspector?.showAncestors(state.inside === "ancestors");
    this.element = this.createElement();
  }

  createElement() {
    const { newest, runs, link } = this.selector;
    const { stage, foot, facts } = this.map;
    this.title = el(
      "h2",
      { class: "number", "data-testid": "live-caption" },
      "Simulating the first generation …",
    );
    stage.addEventListener("wheel", (event) => this.handleWheel(event), { capture: true });
    const element = el(
      "section",
      { class: "card live-world", "aria-label": "World" },
      el(
        "div",
        { class: "row" },
        this.title,
        newest,
        el("span", { class: "spread" }),
        runs,
        link,
      ),
      stage,
      foot,
      this.legend.root,
      this.inspector?.root ?? facts,
      this.bar.createRow(),
    );
    element.addEventListener("keydown", (event) => this.handleKey(event));
    return element;
  }

  /** Set the number of finished generations. */
  setGenerationsDone(generationsDone) {
    this.selector.generationsDone = generationsDone;
    if (!generationsDone) return;
    if (this.map.source) this.showNewest();
    else this.load(this.startAt);
  }

  /** Show the newest generation, if the user follows it and has seen the previous one. */
  showNewest() {
    const { followsNewest, source } = this.selector;
    const isShown = source.generation <= this.map.source?.generation;
    if (!followsNewest || this.map.loadingLife || this.newestTimer || isShown) return;
    const remaining = this.displayStart + MIN_DISPLAY_TIME - performance.now();
    if (remaining <= 0) return this.load(null);
    this.newestTimer = setTimeout(() => {
      this.newestTimer = 0;
      this.showNewest();
    }, remaining);
  }

  /** Show a generation from its beginning, follow the newest one (null), or show another run. */
  showGeneration(generation, run = this.selector.run) {
    const isOtherRun = run !== this.selector.run;
    this.selector.select(generation, run);
    if (isOtherRun) return this.load(null);
    if (generation !== null) return this.load(0);
    this.selectAgent(this.map, null);
    this.showNewest();
    this.player.play();
  }

  /** Stop following the newest generation, because the user plays, pauses or moves. */
  onUserAction() {
    if (this.selector.followsNewest && this.map.source)
      this.selector.select(this.map.source.generation);
    this.remember();
  }

  /** Load the selected generation. It starts at `step`, or at the current time. */
  load(step) {
    const { source } = this.selector;
    if (source.generation < 0) return;
    this.startAt = step;
    this.map.load(source, openLifetime(source, { agents: this.agents }));
  }

  /** Show the generation that is loaded. */
  loaded() {
    const { life, source } = this.map;
    const isFirst = !this.share;
    this.share ??= mountShare(document.getElementById("actions"), () => this.describeShared());
    this.displayStart = performance.now();
    this.title.textContent = `Generation ${formatNumber(source.generation)}`;
    this.legend.show([life.header]);
    this.player.last = life.steps - 1;
    // A stream would simulate all steps up to the current time.
    const isContinued = !life.isStream && this.player.time < this.player.last;
    this.player.seek(this.startAt ?? (isContinued ? this.player.time : 0));
    if (isFirst && this.selector.followsNewest) this.player.autoplay();
    this.inspect();
    this.showNewest();
  }

  selectAgent(map, agent) {
    if (agent !== null) this.onUserAction();
    super.selectAgent(map, agent);
  }

  openRelative(/** @type {import("../core/sources.js").Source} */ { generation }, agent) {
    this.map.agent = agent;
    this.showGeneration(generation);
  }

  /** Show a change of the player. The newest generation is repeated until a newer one arrives. */
  showTime() {
    super.showTime();
    const { player, map: { life } } = this;
    const hasEnded = life && !player.playing && player.last > 0 && player.time >= player.last;
    if (hasEnded && this.selector.followsNewest) player.play();
  }

  /** Write the generation and the step to the address. */
  remember() {
    this.selector.update();
    if (!this.map.life) return;
    const { player, map: { agent }, selector: { followsNewest, source: { run, generation } } } =
      this;
    this.navigate({
      generation: followsNewest ? null : generation,
      step: followsNewest ? null : Math.floor(player.time),
      run: run || null,
      agent,
      inside: this.inspector?.showsAncestors ? "ancestors" : null,
      speed: player.speed === DEFAULT_SPEED ? null : player.speed,
    });
  }

  /** Handle the keys of the World tab if the focus is in this panel. */
  handleKey(event) {
    if (event.key === "Escape" && this.map.agent !== null) this.selectAgent(this.map, null);
    else if (this.map.life) this.bar.handleKey(event);
  }

  /** Let the wheel scroll the page, unless the map is enlarged or Ctrl is pressed. */
  handleWheel(event) {
    if (!event.ctrlKey && this.map.view.camera.zoom === 1) event.stopPropagation();
  }

  close() {
    clearTimeout(this.newestTimer);
    super.close();
    this.share?.close();
  }
}
