/** One world on the World tab: its selectors and its map. */

import { LifetimeSelector } from "./lifetime_selector.js";
import { el } from "../core/common.js";
import { openLifetime } from "./lifetimes.js";
import { WorldMap } from "./world_map.js";
import { createZoomButtons } from "./gestures.js";

export class WorldPanel extends LifetimeSelector {
  /**
   * @param {string} name "a" or "b"
   * @param {object[]} studies the readable studies of /api/studies
   * @param {import("./world_map.js").MapCallbacks & {chosen: () => void, playAllClicked: () =>
   *   void}} callbacks
   */
  constructor(name, studies, callbacks) {
    super(name, studies, callbacks);
    this.map = new PanelMap("The world", `world-${name}`, callbacks);
    const { note, stage, frames } = this.map;
    this.pickers.append(note);
    stage.append(
      el("div", { class: "zoom-tools" }, createZoomButtons(this.map, ["closer", "farther"])),
    );
    this.root = el(
      "section",
      { class: "panel", "aria-label": name === "a" ? "World" : "Second world" },
      this.pickers,
      stage,
      frames.legend.root,
    );
  }

  get life() {
    return this.map.life;
  }

  choose(source) {
    if (this.setSource(source)) this.map.load(source, openLifetime(source, this.condition ?? {}));
  }

  close() {
    this.curve.close();
    this.map.close();
    this.root.remove();
  }
}

/** The map of a panel. Its text says whether the agents learn. */
class PanelMap extends WorldMap {
  describeMoment(recording, step) {
    const learner = recording.header.learns ? "learns" : "cannot learn";
    return `${learner} · ${super.describeMoment(recording, step)}`;
  }
}
