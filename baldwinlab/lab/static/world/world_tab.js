/** The World tab of models with a world: one or two synchronized worlds, playback and inspector. */

import { createQuery, el, showMessage } from "../core/common.js";
import { GenerationPlayer } from "./lifetime_selector.js";
import { Hint } from "../core/hints.js";
import { handleWorldKey, WorldControls } from "./world_controls.js";
import { Lead } from "./lead.js";
import { Legend } from "./legend.js";
import { Inspector } from "../inspector/inspector.js";
import { chooseSpeed } from "./player.js";
import { Population } from "./population.js";
import { mountShare } from "../share/share.js";
import {
  chooseComparison,
  findNearestLifetime,
  formatLifetimeTitle,
  PRESETS,
} from "../core/sources.js";
import { CURVE, WORLD } from "../core/guide.js";
import { readOptions, readSecondLifetime, WHOLE_MAP, writeOptions } from "./world_address.js";
import { WorldGroup } from "./world_group.js";
import { WorldPanel } from "./world_panel.js";
import { INNATE } from "../results/innate_map.js";

export class WorldTab extends WorldGroup {
  constructor(root, navigate, guide, /** @type {import("../core/sources.js").Stored} */ stored) {
    super("", Inspector);
    this.root = root;
    this.studies = stored.studies;
    this.navigate = navigate;
    this.guide = guide;
    this.trails = "recent";
    this.sight = true;
    this.listing = false;
    /** @type {WorldPanel[]} */
    this.panels = [];
    this.worlds = el("div", { class: "worlds" });
    this.population = new Population((agent) => this.selectAgent(this.maps[0], agent));
    this.generationPlayer = new GenerationPlayer({
      panel: () => this.panels[0],
      visit: (generation) => this.showGeneration(generation),
      changed: (isPlaying) => this.setPlaying(isPlaying),
    });
    this.player.ended = () => this.showEnd();
    this.hint = new Hint("agent", () => this.maps[0].canvas);
    this.lead = new Lead(guide, (generation) => this.replay(generation), this.hint);
    this.controls = new WorldControls(this.bar, {
      set: (change) => this.set(change),
      toggleComparison: () => this.toggleComparison(),
      fit: () => this.fit(),
      goToMeal: (direction) => this.goToMeal(direction),
      showBehavior: () => this.showBehavior(),
    });
    const { signal } = this.leaving;
    addEventListener("keydown", (event) => handleWorldKey(event, this), { signal });
  }

  start(state) {
    const side = el("div", { class: "side" }, this.population.root, this.inspector.root);
    this.root.append(
      el("h1", { class: "visually-hidden" }, "World"),
      this.lead.root,
      el("div", { class: "scene" }, this.worlds, side),
      this.controls.root,
    );
    this.share = mountShare(document.getElementById("actions"), () => this.describeShared());
    this.show(state);
    if (state.step !== undefined) return;
    this.skipsToMeal = true;
    this.player.autoplay();
  }

  /** Show the state of an address with a run. Missing options get their defaults. */
  show(state) {
    const first = findNearestLifetime(this.studies, state);
    this.requirePanel(0).choose(first);
    const second = readSecondLifetime(state, first);
    if (second) this.requirePanel(1).choose(findNearestLifetime(this.studies, second));
    else this.removeSecond();
    this.defaultSpeed = chooseSpeed(this.panels[0].condition.steps);
    const { speed, camera, step, showsAncestors, agent, ...options } = readOptions(
      state,
      this.defaultSpeed,
    );
    Object.assign(this, options);
    for (const map of this.maps) map.agent = null;
    const [a, b = a] = this.maps;
    (state.side === "b" ? b : a).agent = agent;
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
    return this.maps.every(({ loadingLife }) => !loadingLife);
  }

  get drawOptions() {
    const { trails, sight } = this;
    return { ...super.drawOptions, trails, sight };
  }

  requirePanel(number) {
    if (this.panels[number]) return this.panels[number];
    const panel = new WorldPanel("ab"[number], this.studies, {
      invalidate: () => this.player.invalidate(),
      chosen: () => this.onSourceChosen(),
      loaded: () => this.loaded(),
      failed: (error) => showMessage(error.message, "error"),
      picked: (agent) => this.selectAgent(panel.map, agent),
      moved: () => this.setCamera(panel.map.view.camera),
      playAllClicked: () => this.generationPlayer.toggle(),
    });
    this.panels[number] = panel;
    this.maps[number] = panel.map;
    this.worlds.append(panel.root);
    this.root.classList.toggle("comparing", this.panels.length > 1);
    return panel;
  }

  removeSecond() {
    this.panels.splice(1).forEach((panel) => panel.close());
    this.maps.splice(1);
    this.root.classList.remove("comparing");
  }

  onSourceChosen() {
    this.inspect();
    this.showOptions();
    this.remember(false);
  }

  /** Set the camera of all worlds. */
  setCamera({ x, y, zoom }) {
    for (const { view } of this.maps) view.setCamera(x, y, zoom);
    this.remember();
    this.player.invalidate();
  }

  fit() {
    this.setCamera(WHOLE_MAP);
  }

  /** Select an agent or none. The focus moves to the inspector, and back. */
  selectAgent(map, agent) {
    const wasOpen = this.selectedMap.agent !== null;
    const isOpen = agent !== null;
    if (isOpen && !wasOpen) this.opener = /** @type {HTMLElement} */ (document.activeElement);
    for (const other of this.maps) if (other !== map) other.select(null);
    super.selectAgent(map, agent);
    if (isOpen) {
      this.hint.dismiss();
      this.inspector.root.focus();
    } else if (wasOpen)
      (this.opener?.checkVisibility() ? this.opener : this.maps[0].canvas).focus();
  }

  inspect() {
    this.root.classList.toggle("inspecting", this.selectedMap.agent !== null);
    super.inspect();
  }

  /** Open the lifetime of a parent or a child. */
  openRelative(source, agent) {
    const map = this.selectedMap;
    map.agent = agent;
    // The focused link is about to disappear.
    this.inspector.root.focus();
    this.panels.find((panel) => panel.map === map).choose(source);
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
    const lengths = this.maps.filter(({ life }) => life?.steps).map(({ life }) => life.steps);
    if (!lengths.length) return;
    this.showGuide();
    // A list of many agents would be too long.
    this.root.classList.toggle("streaming", Boolean(this.maps[0].life?.isStream));
    this.player.last = Math.max(...lengths) - 1;
    const speed = chooseSpeed(this.player.last + 1);
    // The user has not selected a speed.
    if (this.player.speed === this.defaultSpeed) this.player.speed = speed;
    this.defaultSpeed = speed;
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
    const meals = this.maps.map(({ life }) => life?.findMeal(-1, 1, null) ?? Infinity);
    this.lead.startBefore(Math.min(...meals), this.player);
  }

  /** Say what happened, unless the next generation follows. */
  showEnd() {
    this.generationPlayer.next();
    if (!this.generationPlayer.isPlaying && this.maps.every(({ life }) => life && !life.isStream))
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
    const { life, agent } = this.selectedMap;
    if (life?.isStream) return showMessage("A world of this size has no list of meals.");
    const step = life?.findMeal(Math.floor(this.player.time), direction, agent);
    if (step == null)
      return showMessage(
        direction > 0 ? "Nothing is eaten after this step." : "Nothing was eaten before this step.",
      );
    this.player.pause();
    this.player.seek(step);
  }

  /** Open the map of innate and learned behavior of the first world whose agents learn. */
  showBehavior() {
    const panel = this.panels.find(({ life }) => life?.header.learns);
    if (!panel)
      return showMessage("These agents do not learn. Choose a condition that learns.", "error");
    const { study, condition, run } = panel.source;
    location.hash = `#/results?${createQuery({ study, tab: INNATE, condition, run })}`;
  }

  /** Update the guide from the recording of the first world. */
  showGuide() {
    const headers = this.maps.map(({ life }) => life?.header).filter(Boolean);
    const names = this.panels.map(({ source }) => el("p", {}, formatLifetimeTitle(source)));
    if (this.panels.some(({ source }) => source.study !== PRESETS)) names.push(el("p", {}, CURVE));
    const legend = new Legend();
    for (const legendView of [legend, this.controls.legend]) legendView.show(headers);
    this.guide.setTexts(WORLD, [
      { title: "Shown here", text: el("div", {}, names, legend.root) },
      ...headers[0].topics,
    ]);
  }

  draw(time) {
    const isLoaded = super.draw(time);
    for (const { curve } of this.panels) curve.draw();
    const step = Math.floor(time);
    const recording = this.maps[0]?.life?.findPart(step);
    if (recording && this.selectedMap.agent === null)
      this.population.draw(recording, Math.min(step, recording.last - 1), this.player.playing);
    return isLoaded;
  }

  showOptions() {
    const { trails, sight, listing } = this;
    const isComparing = this.panels.length > 1;
    const isStored = this.panels[0]?.source.study !== PRESETS;
    this.controls.showOptions({ trails, sight, listing, isComparing, isStored });
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
    super.close();
    this.share?.close();
    this.panels.forEach((panel) => panel.close());
  }
}
