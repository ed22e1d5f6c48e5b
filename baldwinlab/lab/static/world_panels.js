/** The worlds of the World tab, their camera, and the selected agent with its inspector. */

import { el, showMessage } from "./common.js";
import { Inspector } from "./inspector.js";
import { Player } from "./player.js";
import { Population } from "./population.js";
import { WHOLE_MAP } from "./world_address.js";
import { WorldPanel } from "./world_panel.js";

/** The base class of `WorldTab`, which overrides the methods without a body. */
export class WorldPanels {
  constructor(root, /** @type {object[]} */ studies) {
    this.root = root;
    this.studies = studies;
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
  }

  /** Draw a moment. Return whether it is loaded. */
  draw(_time) {
    return true;
  }

  /** Handle a lifetime that is loaded. */
  loaded() {}

  /** Write the state to the address. */
  remember(_replace = true) {}

  /** Show the options of the current lifetimes. */
  showOptions() {}

  /** Play or stop the generations one after another. */
  toggleGenerations() {}

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
      playAllClicked: () => this.toggleGenerations(),
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
}
