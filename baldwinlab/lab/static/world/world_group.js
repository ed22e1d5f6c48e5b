/** Worlds that play together: their maps, one time bar, and the inspector of an agent. */

import { Player } from "./player.js";
import { createLifetime } from "./recording.js";
import { TimeBar } from "./time_bar.js";

export class WorldGroup {
  /**
   * @param {string} testid prefix of the test ids of the time bar
   * @param {typeof import("../inspector/inspector.js").Inspector|null} [Inspector] null: without an inspector
   */
  constructor(testid, Inspector = null) {
    /** @type {import("./world_map.js").WorldMap[]} */
    this.maps = [];
    this.player = new Player((time) => this.draw(time));
    this.bar = new TimeBar(this.player, testid, () => this.onUserAction());
    this.player.changed = () => this.showTime();
    this.inspector = Inspector &&
      new Inspector({
        open: (source, agent) => this.openRelative(source, agent),
        close: () => this.selectAgent(this.selectedMap, null),
        seek: (step) => (step === null ? this.player.invalidate() : this.seek(step)),
        toggled: () => this.remember(),
      });
    const { signal } = (this.leaving = new AbortController());
    matchMedia("(prefers-color-scheme: dark)").addEventListener(
      "change",
      () => this.player.invalidate(),
      { signal },
    );
  }

  /** The map with the selected agent, or the first one. */
  get selectedMap() {
    return this.maps.find(({ agent }) => agent !== null) ?? this.maps[0];
  }

  /** How maps are drawn. Subclasses have more options. */
  get drawOptions() {
    return { pace: this.player.pace };
  }

  /** Show recordings of complete lifetimes, or of their first steps. */
  showRecordings(recordings) {
    recordings.forEach((recording, index) => this.maps[index].show(createLifetime(recording)));
    this.player.last = Math.max(...recordings.map(({ last }) => last)) - 1;
  }

  /** Select an agent of a map, or none. */
  selectAgent(map, agent) {
    map.select(agent);
    this.inspect();
    this.remember();
  }

  /** Show the selected agent in the inspector. */
  inspect() {
    const { agent, source } = this.selectedMap;
    if (agent === null || !source) this.inspector?.hide();
    else this.inspector?.show(source, agent);
  }

  /** Move because the user clicks a chart of the inspector. */
  seek(step) {
    this.onUserAction();
    this.player.seek(step);
  }

  showTime() {
    this.bar.showTime();
    this.remember();
  }

  /**
   * Draw a moment.
   * @returns {boolean} whether all worlds have loaded it
   */
  draw(time) {
    const drawn = this.maps.map((map) => map.draw(time, this.drawOptions));
    if (drawn.some(({ ready }) => !ready)) this.player.invalidate();
    const shown = this.maps.filter(({ life }) => life);
    if (!shown.length) return false;
    this.player.maxPace = Math.min(...shown.map(({ life }) => life.maxPace));
    const step = Math.floor(time);
    this.bar.draw(step, shown);
    this.inspector?.draw(step);
    if (this.player.playing) this.remember();
    return drawn.every(({ isLoaded }) => isLoaded);
  }

  /** Return the state for the share menu. */
  describeShared() {
    return {
      panels: this.maps.map(({ source, canvas, agent }) => ({ source, canvas, agent })),
      step: Math.floor(this.player.time),
    };
  }

  /** Called before the user plays, pauses or moves. Overridden. */
  onUserAction() {}

  /** Write the state to the address. Overridden. */
  remember() {}

  /** Open the lifetime of a parent or a child. Overridden. */
  openRelative(_source, _agent) {}

  close() {
    this.leaving.abort();
    this.player.close();
    this.inspector?.hide();
    for (const map of this.maps) map.close();
  }
}
