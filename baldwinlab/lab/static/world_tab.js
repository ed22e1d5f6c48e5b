/** The World tab of models with a world: one or two synchronized worlds, playback and inspector. */

import { openBehaviorMap } from "./behavior_map.js";
import { el, showMessage } from "./common.js";
import { handleWorldKey } from "./keys.js";
import { Lead } from "./lead.js";
import { Legend } from "./legend.js";
import { Inspector } from "./inspector.js";
import { chooseSpeed, Player } from "./player.js";
import { Population } from "./population.js";
import { mountShare } from "./share.js";
import {
  addTypicalRun,
  chooseComparison,
  createLifetimeQuery,
  findNearestLifetime,
  formatLifetimeTitle,
  PRESETS,
} from "./sources.js";
import { Timeline } from "./timeline.js";
import { CURVE, WORLD } from "./topics.js";
import { GenerationPlayer } from "./generation_player.js";
import { PlaybackBar } from "./playback_bar.js";
import { readOptions, readSecondLifetime, WHOLE_MAP, writeOptions } from "./world_address.js";
import { WorldPanel } from "./world_panel.js";

export class WorldTab {
  constructor(root, navigate, guide, /** @type {import("./sources.js").Stored} */ stored) {
    this.root = root;
    this.studies = stored.studies;
    this.navigate = navigate;
    this.guide = guide;
    this.latestRequest = 0;
    this.closed = false;
    this.trails = "recent";
    this.sight = true;
    this.listing = false;
    this.panels = [];
    // The selected agent, or null, and the world that it belongs to.
    this.agent = null;
    this.side = "a";
    this.worlds = el("div", { class: "worlds" });
    this.player = new Player((time) => this.draw(time));
    this.population = new Population((agent) => this.pick("a", agent));
    this.inspector = new Inspector({
      open: (source, agent) => this.openRelative(source, agent),
      close: () => this.pick(this.side, null),
      seek: (step) => (step === null ? this.player.invalidate() : this.player.seek(step)),
      toggled: () => this.remember(),
    });
    this.player.changed = () => this.showTime();
    this.generationPlayer = new GenerationPlayer({
      now: () => ({
        generation: this.panels[0].source.generation,
        last: this.panels[0].condition.generations - 1,
      }),
      visit: (generation) => this.showGeneration(generation),
      changed: (isPlaying) => this.setPlaying(isPlaying),
    });
    this.player.ended = () => this.showEnd();
    this.lead = new Lead(guide, (generation) => this.replay(generation));
    const { signal } = (this.leaving = new AbortController());
    matchMedia("(prefers-color-scheme: dark)").addEventListener(
      "change",
      () => this.player.invalidate(),
      { signal },
    );
    addEventListener("keydown", (event) => handleWorldKey(event, this), { signal });
    this.timeline = new Timeline((step) => this.player.seek(step));
  }

  async start(state) {
    this.build();
    await this.show(state);
    if (state.step === undefined && !this.closed) {
      this.skipsToMeal = true;
      if (this.isLoaded) this.loaded();
      this.player.autoplay();
    }
  }

  /** Show the state of an address. Without a run, show the typical run. */
  async show(state) {
    const request = ++this.latestRequest;
    const completeState = await addTypicalRun(this.studies, state);
    if (request === this.latestRequest && !this.closed) this.applyState(completeState);
  }

  build() {
    const callbacks = {
      set: (change) => this.set(change),
      toggleComparison: () => this.toggleComparison(),
      fit: () => this.fit(),
      goToMeal: (direction) => this.goToMeal(direction),
      showBehavior: () => this.showBehavior(),
    };
    this.playbackBar = new PlaybackBar(this.player, this.timeline, callbacks);
    const side = el("div", { class: "side" }, this.population.root, this.inspector.root);
    this.root.append(
      el("h1", { class: "visually-hidden" }, "World"),
      this.lead.root,
      el("div", { class: "scene" }, this.worlds, side),
      this.playbackBar.root,
    );
    this.share = mountShare(document.getElementById("actions"), () => ({
      panels: this.panels.map(({ source, canvas }) => ({
        source: String(createLifetimeQuery(source)),
        canvas,
      })),
      step: Math.floor(this.player.time),
    }));
  }

  /** Apply a state. Missing options get their defaults. */
  applyState(state) {
    const first = findNearestLifetime(this.studies, state);
    this.requirePanel(0).choose(first);
    const second = readSecondLifetime(state, first);
    if (second) this.requirePanel(1).choose(findNearestLifetime(this.studies, second));
    else this.removeSecond();
    this.defaultSpeed = chooseSpeed(this.panels[0].condition.steps);
    const { speed, camera, step, showsAncestors, ...options } = readOptions(
      state,
      this.defaultSpeed,
    );
    Object.assign(this, options, { side: state.side === "b" && this.panels[1] ? "b" : "a" });
    this.player.speed = speed;
    this.inspector.showAncestors(showsAncestors);
    // The user can move on while a lifetime loads.
    if (step !== undefined && step !== Math.floor(this.player.time)) this.startAt = step;
    if (this.isLoaded) this.loaded();
    this.setCamera(camera);
    this.showOptions();
    this.showTime();
    this.inspect();
  }

  /** Whether no lifetime is loading. */
  get isLoaded() {
    return this.panels.every(({ loadingLife }) => !loadingLife);
  }

  requirePanel(number) {
    if (this.panels[number]) return this.panels[number];
    const name = "ab"[number];
    const panel = new WorldPanel(name, this.studies, {
      invalidate: () => this.player.invalidate(),
      chosen: () => this.onSourceChosen(),
      loaded: () => this.loaded(),
      failed: (error) => showMessage(error.message, "error"),
      picked: (agent) => this.pick(name, agent),
      moved: () => this.setCamera(panel.view.camera),
      fitted: () => this.fit(),
      playAllClicked: () => this.generationPlayer.toggle(),
    });
    this.panels[number] = panel;
    this.worlds.append(panel.root);
    this.root.classList.toggle("comparing", this.panels.length > 1);
    return panel;
  }

  removeSecond() {
    this.panels.splice(1).forEach((panel) => panel.close());
    this.root.classList.remove("comparing");
    if (this.side === "b") {
      this.side = "a";
      this.agent = null;
    }
  }

  onSourceChosen() {
    this.inspect();
    this.showOptions();
    this.remember(false);
  }

  /** Set the camera of all worlds. */
  setCamera({ x, y, zoom }) {
    for (const { view } of this.panels) view.setCamera(x, y, zoom);
    this.remember();
    this.player.invalidate();
  }

  fit() {
    this.setCamera(WHOLE_MAP);
  }

  /** Select an agent or none. The focus moves to the inspector, and back. */
  pick(side, agent) {
    const wasOpen = this.agent !== null;
    const isOpen = agent !== null;
    if (isOpen && !wasOpen) this.opener = document.activeElement;
    this.side = side;
    this.agent = agent;
    this.inspect();
    if (isOpen) this.inspector.root.focus();
    else if (wasOpen)
      (this.opener?.checkVisibility() ? this.opener : this.panels[0].canvas).focus();
    this.remember();
    this.player.invalidate();
  }

  inspect() {
    const panel = this.panels.find(({ name }) => name === this.side);
    this.root.classList.toggle("inspecting", this.agent !== null);
    if (this.agent === null || !panel?.source) this.inspector.hide();
    else this.inspector.show(panel.source, this.agent);
  }

  /** Open the lifetime of a parent or a child. */
  openRelative(source, agent) {
    this.agent = agent;
    // The focused link is about to disappear.
    this.inspector.root.focus();
    this.panels.find(({ name }) => name === this.side).choose(source);
    this.player.seek(0);
    this.onSourceChosen();
  }

  /** Move by some generations. Negative numbers move back. */
  changeGeneration(offset) {
    this.panels.forEach((panel) => panel.move(offset));
  }

  toggleComparison() {
    if (this.panels.length > 1) this.removeSecond();
    else this.requirePanel(1).choose(chooseComparison(this.panels[0]));
    this.loaded();
    this.onSourceChosen();
  }

  /** Update the length of playback after a lifetime is loaded. */
  loaded() {
    const lengths = this.panels.filter(({ life }) => life?.steps).map(({ life }) => life.steps);
    if (!lengths.length) return;
    this.showGuide();
    // A list of many agents would be too long.
    this.root.classList.toggle("streaming", Boolean(this.panels[0].life?.isStream));
    this.player.last = Math.max(...lengths) - 1;
    const speed = chooseSpeed(this.player.last + 1);
    // The user has not selected a speed.
    if (this.player.speed === this.defaultSpeed) this.player.speed = speed;
    this.defaultSpeed = speed;
    this.timeline.setLast(this.player.last);
    if (this.startAt !== undefined) this.player.seek(Math.min(this.startAt, this.player.last));
    else if (this.player.time > this.player.last) this.player.seek(this.player.last);
    this.startAt = undefined;
    this.lead.ask(this.panels);
    if (this.skipsToMeal && this.isLoaded) this.skipToMeal();
    if (this.generationPlayer.isPlaying && this.isLoaded) this.player.play();
    this.showTime();
  }

  /** Start just before the first meal of all worlds. */
  skipToMeal() {
    this.skipsToMeal = false;
    const meals = this.panels.map(({ life }) => life?.findMeal?.(-1, 1, null) ?? Infinity);
    this.lead.startBefore(Math.min(...meals), this.player);
  }

  /** Say what happened, unless the next generation follows. */
  showEnd() {
    this.generationPlayer.next();
    if (!this.generationPlayer.isPlaying && this.panels.every(({ life }) => life && !life.isStream))
      this.lead.showEnd(this.panels, this.panels[0].condition.generations - 1);
  }

  /** Play the lifetime of a generation. */
  replay(generation) {
    this.showGeneration(generation);
    this.player.play();
  }

  /** Show the lifetime of a generation from its beginning. */
  showGeneration(generation) {
    this.startAt = 0;
    this.panels.forEach((panel) => panel.goTo(generation));
    if (this.isLoaded) this.loaded();
  }

  setPlaying(isPlaying) {
    if (!isPlaying) this.player.pause();
    for (const { playButton } of this.panels) playButton.setAttribute("aria-pressed", isPlaying);
  }

  /** Go to the nearest meal of the selected agent, or of any agent. */
  goToMeal(direction) {
    const { life } = this.panels.find(({ name }) => name === this.side);
    if (life?.isStream) return showMessage("A world of this size has no list of meals.");
    const step = life?.findMeal(Math.floor(this.player.time), direction, this.agent);
    if (step == null)
      return showMessage(
        direction > 0 ? "Nothing is eaten after this step." : "Nothing was eaten before this step.",
      );
    this.player.pause();
    this.player.seek(step);
  }

  /** Show innate and learned behavior of the first world whose agents learn. */
  showBehavior() {
    const panel = this.panels.find(({ life }) => life?.header.learns);
    if (!panel)
      return showMessage("These agents do not learn. Choose a condition that learns.", "error");
    openBehaviorMap(panel.source, {
      agent: (agent) => this.pick(panel.name, agent),
      generation: (generation) => this.replay(generation),
    });
  }

  /** Update the guide from the recording of the first world. */
  showGuide() {
    const headers = this.panels.map(({ life }) => life?.header).filter(Boolean);
    const names = this.panels.map(({ source }) => el("p", {}, formatLifetimeTitle(source)));
    if (this.panels.some(({ source }) => source.study !== PRESETS)) names.push(el("p", {}, CURVE));
    const legend = new Legend();
    for (const legendView of [legend, this.playbackBar.legend]) legendView.show(headers);
    this.guide.setTexts(WORLD, [
      { title: "Shown here", text: el("div", {}, names, legend.root) },
      ...headers[0].topics,
    ]);
  }

  draw(time) {
    let isLoaded = true;
    for (const panel of this.panels) {
      const selectedAgent = panel.name === this.side ? this.agent : null;
      const { trails, sight } = this;
      const { pace } = this.player;
      const drawn = panel.draw(time, { trails, sight, selectedAgent, pace });
      isLoaded &&= drawn.isLoaded;
      if (!drawn.ready) this.player.invalidate();
    }
    this.player.maxPace = Math.min(...this.panels.map(({ life }) => life?.maxPace ?? Infinity));
    const step = Math.floor(time);
    const tracks = this.panels
      .filter(({ life }) => life)
      .map(({ life, name }) => ({ life, selectedAgent: name === this.side ? this.agent : null }));
    if (tracks.length) this.timeline.draw(tracks);
    this.timeline.show(step);
    this.playbackBar.showStep(step);
    const recording = this.panels[0]?.life?.findPart(step);
    if (recording && this.agent === null)
      this.population.draw(recording, Math.min(step, recording.last - 1), this.player.playing);
    this.inspector.draw(step);
    if (this.player.playing) this.remember();
    return isLoaded && tracks.length > 0;
  }

  showTime() {
    if (!this.playbackBar) return;
    this.playbackBar.showTime();
    this.remember();
  }

  showOptions() {
    const { trails, sight, listing } = this;
    this.playbackBar.showOptions({ trails, sight, listing, isComparing: this.panels.length > 1 });
    this.root.classList.toggle("listing", listing);
  }

  set(change) {
    Object.assign(this, change);
    this.showOptions();
    this.remember();
    this.player.invalidate();
  }

  /** Write the state to the address. Another lifetime is a new history entry. */
  remember(replace = true) {
    if (this.panels[0]?.source && !this.panels.some(({ curve }) => curve.isDragging))
      this.navigate(writeOptions(this), replace);
  }

  close() {
    this.closed = true;
    this.leaving.abort();
    this.share?.close();
    this.player.close();
    this.panels.forEach((panel) => panel.close());
    this.inspector.hide();
  }
}
