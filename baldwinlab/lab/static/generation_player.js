/** A tour through evolution: the lives of some generations by themselves, from the first to the last. */

const STOPS = [0, 5, 20]; // early on much changes, and then little; the last generation comes as well

export class GenerationPlayer {
  /**
   * @param {{now: () => {generation: number, last: number}, visit: (generation: number) => void, changed: (on: boolean) => void}} callbacks
   * @param {(last: number) => number[]} stops the generations that are shown, up to the last
   */
  constructor(callbacks, stops = (last) => [...STOPS, last]) {
    Object.assign(this, { callbacks, stops });
    this.on = false;
  }

  toggle() {
    this.set(!this.on);
    if (this.on) this.callbacks.visit(0);
  }

  /** A life is over. */
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
