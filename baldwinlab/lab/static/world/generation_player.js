/** Play the lifetimes of selected generations one after another. */

// Changes are largest in early generations. The last generation is added.
const FIRST_STOPS = [0, 5, 20];

export class GenerationPlayer {
  /**
   * @param {{panel: () => import("./lifetime_selector.js").LifetimeSelector, visit: (generation:
   *   number) => void, changed: (isPlaying: boolean) => void}} callbacks
   * @param {(last: number) => number[]} stops the generations to show, up to the last
   */
  constructor(callbacks, stops = (last) => [...FIRST_STOPS, last]) {
    this.callbacks = callbacks;
    this.stops = stops;
    this.isPlaying = false;
  }

  toggle() {
    this.set(!this.isPlaying);
    if (this.isPlaying) this.callbacks.visit(0);
  }

  /** Continue after the end of a lifetime. */
  next() {
    if (!this.isPlaying) return;
    const { source: { generation }, condition } = this.callbacks.panel();
    const last = condition.generations - 1;
    const next = this.stops(last).find((stop) => stop > generation && stop <= last);
    if (next === undefined) this.set(false);
    else this.callbacks.visit(next);
  }

  set(isPlaying) {
    this.isPlaying = isPlaying;
    this.callbacks.changed(isPlaying);
  }
}
