/** Play the lifetimes of selected generations one after another. */

// Changes are largest in early generations. The last generation is added.
const STOPS = [0, 5, 20];

export class GenerationPlayer {
  /**
   * @param {{now: () => {generation: number, last: number}, visit: (generation: number) => void,
   *   changed: (on: boolean) => void}} callbacks
   * @param {(last: number) => number[]} stops the generations to show, up to the last
   */
  constructor(callbacks, stops = (last) => [...STOPS, last]) {
    Object.assign(this, { callbacks, stops });
    this.on = false;
  }

  toggle() {
    this.set(!this.on);
    if (this.on) this.callbacks.visit(0);
  }

  /** Continue after the end of a lifetime. */
  next() {
    if (!this.on) return;
    const { generation, last } = this.callbacks.now();
    const next = this.stops(last).find((stop) => stop > generation && stop <= last);
    if (next === undefined) this.set(false);
    else this.callbacks.visit(next);
  }

  set(on) {
    this.on = on;
    this.callbacks.changed(on);
  }
}
