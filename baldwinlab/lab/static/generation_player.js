/** A tour through evolution: the lives of some generations by themselves, from the first to the last. */

const STOPS = [0, 5, 20]; // early on much changes, and then little; the last generation comes as well

export class GenerationPlayer {
  /**
   * @param {{now: () => {generation: number, last: number}, visit: (generation: number) => void, changed: (on: boolean) => void}} tell
   * @param {(last: number) => number[]} stops the generations that are shown, up to the last
   */
  constructor(tell, stops = (last) => [...STOPS, last]) {
    Object.assign(this, { tell, stops });
    this.on = false;
  }

  toggle() {
    this.set(!this.on);
    if (this.on) this.tell.visit(0);
  }

  /** A life is over. */
  next() {
    if (!this.on) return;
    const { generation, last } = this.tell.now();
    const stop = this.stops(last).find((each) => each > generation && each <= last);
    if (stop === undefined) this.set(false);
    else this.tell.visit(stop);
  }

  set(on) {
    this.on = on;
    this.tell.changed(on);
  }
}
