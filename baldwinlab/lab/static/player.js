/** The playback time. It calls a function to draw each frame. */

export const SPEEDS = [1, 2, 5, 10, 20, 50, 100, 200, 500, 1000];
// At speed 1.
const STEPS_A_SECOND = 10;
// Minimum duration of a lifetime at its default speed, in seconds.
const WHOLE_LIFE = 6;

/** Return the default speed for a lifetime with this number of steps. */
export function defaultSpeed(steps) {
  return SPEEDS.findLast((speed) => steps / (speed * STEPS_A_SECOND) >= WHOLE_LIFE) ?? SPEEDS[0];
}

export class Player {
  /**
   * @param {(time: number) => boolean} show draws a moment; returns false if it is not loaded, so
   *   time waits
   */
  constructor(show) {
    this.show = show;
    // In steps, with fractions.
    this.time = 0;
    // The last step.
    this.last = 0;
    this.speed = 10;
    this.playing = false;
    this.changed = () => {};
    // Called after the last step.
    this.ended = () => {};
    this.asked = 0;
    this.before = 0;
  }

  /** Draw in the next frame. */
  invalidate() {
    this.asked ||= requestAnimationFrame((now) => this.frame(now));
  }

  frame(now) {
    this.asked = 0;
    // A page that was hidden does not jump ahead.
    const elapsed = this.before ? Math.min(now - this.before, 100) : 0;
    this.before = this.playing ? now : 0;
    const isLoaded = this.show(this.time);
    if (!this.playing) return;
    if (isLoaded) {
      this.time = Math.min(this.time + (elapsed / 1000) * this.speed * STEPS_A_SECOND, this.last);
      if (this.time >= this.last) {
        this.show(this.time);
        this.pause();
        this.ended();
      }
    }
    this.invalidate();
  }

  /** Start playback, unless the user prefers reduced motion. */
  autoplay() {
    if (!matchMedia("(prefers-reduced-motion: reduce)").matches) this.play();
  }

  /** Play. At the end, start again from the beginning. */
  play() {
    if (this.playing) return;
    if (this.time >= this.last) this.time = 0;
    this.playing = true;
    this.before = 0;
    this.changed();
    this.invalidate();
  }

  pause() {
    if (!this.playing) return;
    this.playing = false;
    this.time = Math.floor(this.time);
    this.changed();
    this.invalidate();
  }

  toggle() {
    if (this.playing) this.pause();
    else this.play();
  }

  /** Go to a step. Playback continues from there. */
  seek(step) {
    this.time = Math.min(Math.max(0, step), this.last);
    this.changed();
    this.invalidate();
  }

  /** Pause, and move by some steps. */
  step(by) {
    this.pause();
    this.seek(Math.floor(this.time) + by);
  }

  setSpeed(speed) {
    this.speed = SPEEDS.includes(Number(speed)) ? Number(speed) : 10;
    this.changed();
  }

  /** Select the next higher or lower speed. */
  changeSpeed(by) {
    const at = SPEEDS.indexOf(this.speed) + by;
    this.setSpeed(SPEEDS[Math.min(Math.max(0, at), SPEEDS.length - 1)]);
  }

  close() {
    cancelAnimationFrame(this.asked);
    this.playing = false;
  }
}
