/** The world of a live run: the newest generation, or a selected one. */

import { createQuery, el, showMessage } from "./common.js";
import { createFreezerButton } from "./freezer_button.js";
import { Legend } from "./legend.js";
import { openLifetime } from "./lifetimes.js";
import { Player } from "./player.js";
import {
  createNewestButton,
  createRunPicker,
  createWorldLink,
  parseWholeNumber,
} from "./run_picker.js";
import { mountShare } from "./share.js";
import { createLifetimeQuery } from "./sources.js";
import { TimeBar } from "./time_bar.js";
import { WorldFigure } from "./world_figure.js";

// Milliseconds that a generation is shown before a newer one replaces it.
const MIN_DISPLAY_TIME = 1000;

const DEFAULT_SPEED = 100;

/** @type {typeof import("./inspector.js").Inspector|null} */
let Inspector = null;

/** Set the agent inspector of all live runs. An exported page has none. */
export function setInspector(inspector) {
  Inspector = inspector;
}

export class LiveWorld {
  /**
   * @param {string} id of the live run
   * @param {number} runs
   * @param {Object<string, string>} state of the address: speed, run, generation (by default the
   *   newest), step, agent
   * @param {(patch: Object<string, any>) => void} navigate
   * @param {number} agents of the world
   */
  constructor(id, runs, state, navigate, agents) {
    this.id = id;
    this.agents = agents;
    this.navigate = navigate;
    this.generationsDone = 0;
    this.life = null;
    this.loadingLife = null;
    this.generation = null;
    this.savedStudy = null;
    this.displayStart = 0;
    this.newestTimer = 0;
    this.run = Math.min(parseWholeNumber(state.run) ?? 0, runs - 1);
    this.initial = {
      generation: parseWholeNumber(state.generation),
      step: parseWholeNumber(state.step) ?? 0,
    };
    this.followsNewest = this.initial.generation === null;
    this.player = new Player((time) => this.draw(time));
    this.player.setSpeed(Number(state.speed) || DEFAULT_SPEED);
    this.figure = new WorldFigure("World of the generation shown", "live-canvas", {
      invalidate: () => this.player.invalidate(),
      picked: (agent) => this.picked(agent),
    });
    this.figure.agent = parseWholeNumber(state.agent);
    this.bar = new TimeBar(this.player, "live", () => this.stopFollowing());
    this.legend = new Legend();
    this.share = null;
    this.inspector = this.createInspector();
    this.inspector?.showAncestors(state.inside === "ancestors");
    this.element = this.createElement(runs);
    this.player.changed = () => this.changed();
  }

  createInspector() {
    if (!Inspector) return null;
    return new Inspector({
      open: (source, agent) => this.openRelative(source, agent),
      close: () => this.figure.pick(null),
      seek: (step) => (step === null ? this.player.invalidate() : this.goTo(step)),
      toggled: () => this.remember(),
    });
  }

  createElement(runs) {
    this.createControls(runs);
    const { stage, foot, facts } = this.figure;
    stage.classList.add("scrolls");
    stage.addEventListener("wheel", (event) => this.handleWheel(event), { capture: true });
    const element = el(
      "section",
      { class: "card live-world", "aria-label": "World" },
      el(
        "div",
        { class: "row" },
        this.title,
        this.newest,
        el("span", { class: "spread" }),
        this.picker,
        this.keep,
        this.open,
      ),
      stage,
      foot,
      this.legend.root,
      this.inspector?.root ?? facts,
      this.bar.root,
    );
    element.addEventListener("keydown", (event) => this.handleKey(event));
    return element;
  }

  createControls(runs) {
    this.title = el(
      "h2",
      { class: "number", "data-testid": "live-caption" },
      "Simulating the first generation …",
    );
    this.newest = createNewestButton(this.followsNewest, () => this.followNewest());
    this.open = createWorldLink();
    this.keep = createFreezerButton("Keep this population", "keep-live", () => ({
      source: this.source,
    }));
    if (this.keep) this.keep.hidden = true;
    this.picker = createRunPicker(runs, this.run, (run) => {
      this.run = run;
      if (this.generation !== null) this.load(this.generation);
    });
  }

  /** Set the number of finished generations. */
  setGenerationsDone(generationsDone) {
    this.generationsDone = generationsDone;
    if (!generationsDone || this.loadingLife) return;
    if (this.generation === null)
      this.load(
        Math.min(this.initial.generation ?? generationsDone - 1, generationsDone - 1),
        this.initial.step,
      );
    else this.showNewest();
  }

  /** Show the newest generation, if the user follows it and has seen the previous one. */
  showNewest() {
    if (
      !this.followsNewest ||
      this.loadingLife ||
      this.newestTimer ||
      this.generationsDone - 1 <= this.generation
    )
      return;
    const remaining = this.displayStart + MIN_DISPLAY_TIME - performance.now();
    if (remaining <= 0) return this.load(this.generationsDone - 1);
    this.newestTimer = setTimeout(() => {
      this.newestTimer = 0;
      this.showNewest();
    }, remaining);
  }

  followNewest() {
    this.followsNewest = true;
    this.figure.pick(null);
    this.remember();
    this.showNewest();
    this.player.play();
  }

  /** Stop following the newest generation. */
  stopFollowing() {
    if (!this.followsNewest) return;
    this.followsNewest = false;
    this.remember();
  }

  /** Show a selected generation of a run. */
  pick(generation, run = this.run) {
    this.followsNewest = false;
    this.run = run;
    if (this.picker) this.picker.value = String(run);
    this.load(generation, 0);
  }

  /** Load a generation. It starts at `step`, or at the current time. */
  load(generation, step = null) {
    this.loadingLife?.close();
    const source = { live: this.id, run: this.run, generation };
    const life = openLifetime(
      source,
      { agents: this.agents },
      () =>
        life === this.loadingLife ? this.showLife(life, source, step) : this.player.invalidate(),
      (error) => showMessage(error.message, "error"),
    );
    this.loadingLife = life;
  }

  showLife(life, source, step) {
    this.loadingLife = null;
    if (!life.isLoaded) return;
    const isFirst = this.generation === null;
    this.life?.close();
    this.life = life;
    this.source = source;
    if (this.keep) this.keep.hidden = false;
    this.generation = source.generation;
    this.displayStart = performance.now();
    this.share ??= mountShare(document.getElementById("actions"), () => this.describeShared());
    this.title.textContent = `Generation ${source.generation.toLocaleString("en")}`;
    this.figure.show(life);
    this.legend.show([life.header]);
    this.player.last = life.steps - 1;
    // A stream would simulate all steps up to the current time.
    const isContinued = !life.isStream && this.player.time < this.player.last;
    this.player.seek(step ?? (isContinued ? this.player.time : 0));
    const prefersStill = matchMedia("(prefers-reduced-motion: reduce)").matches;
    if (isFirst && this.followsNewest && !prefersStill) this.player.play();
    this.inspect();
    this.remember();
    this.showNewest();
  }

  picked(agent) {
    if (agent !== null) this.stopFollowing();
    this.inspect();
    this.remember();
  }

  inspect() {
    const { agent } = this.figure;
    if (agent === null || !this.source) this.inspector?.hide();
    else this.inspector?.show(this.source, agent);
  }

  /** Open the lifetime of a parent or a child. */
  openRelative(/** @type {import("./sources.js").Source} */ { generation }, agent) {
    this.followsNewest = false;
    this.figure.agent = agent;
    this.load(generation, 0);
  }

  goTo(step) {
    this.stopFollowing();
    this.player.seek(step);
  }

  /** Handle a change of the player. The newest generation is repeated until a newer one arrives. */
  changed() {
    const { player } = this;
    this.bar.showTime();
    if (
      this.followsNewest &&
      this.life &&
      !player.playing &&
      player.last > 0 &&
      player.time >= player.last
    )
      player.play();
    else this.remember();
  }

  /** Write the generation and the step to the address. */
  remember() {
    this.newest.setAttribute("aria-pressed", String(this.followsNewest));
    if (this.generation === null) return;
    const { generation, run, player, figure } = this;
    const position = this.followsNewest
      ? { generation: null, step: null }
      : { generation, step: Math.floor(player.time) };
    const inside = this.inspector?.showsAncestors ? "ancestors" : null;
    this.navigate({
      ...position,
      run: run || null,
      agent: figure.agent,
      inside,
      speed: player.speed === DEFAULT_SPEED ? null : player.speed,
    });
    this.open.hidden = !this.savedStudy;
    this.open.href = `#/world?${createQuery({ ...this.savedStudy, run, generation })}`;
  }

  /** Return the state for the share menu. */
  describeShared() {
    return {
      panels: [{ source: String(createLifetimeQuery(this.source)), canvas: this.figure.canvas }],
      step: Math.floor(this.player.time),
    };
  }

  /** Set the study that the run was saved as. The World tab can then show it. */
  setSaved(study, condition) {
    this.savedStudy = { study, condition };
    this.remember();
  }

  draw(time) {
    const { isLoaded, ready } = this.figure.draw(time, this.player.pace);
    this.player.maxPace = this.life?.maxPace ?? Infinity;
    if (!ready) this.player.invalidate();
    if (!this.life) return isLoaded;
    const step = Math.floor(time);
    this.bar.draw(step, this.life.steps, [{ life: this.life, selectedAgent: this.figure.agent }]);
    this.inspector?.draw(step);
    if (this.player.playing && !this.followsNewest) this.remember();
    return isLoaded;
  }

  /** Handle the keys of the World tab if the focus is in this panel. */
  handleKey(event) {
    if (event.key === "Escape" && this.figure.agent !== null) this.figure.pick(null);
    else if (this.life) this.bar.handleKey(event);
  }

  /** Let the wheel scroll the page, unless the map is enlarged or Ctrl is pressed. */
  handleWheel(event) {
    if (!event.ctrlKey && this.figure.view.camera.zoom === 1) event.stopPropagation();
  }

  close() {
    clearTimeout(this.newestTimer);
    this.share?.close();
    this.figure.close();
    this.inspector?.hide();
    this.player.close();
    this.loadingLife?.close();
    // A lifetime that arrives later is ignored.
    this.loadingLife = null;
    this.life?.close();
  }
}
