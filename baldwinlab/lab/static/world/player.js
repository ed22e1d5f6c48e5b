/** The playback time. It calls a function to draw each frame. */

export const SPEEDS = [1, 2, 5, 10, 20, 50, 100, 200, 500, 1000];
// At speed 1.
const STEPS_PER_SECOND = 10;
// Minimum duration of a lifetime at its default speed, in seconds.
const MIN_DURATION = 6;

/** Return the default speed for a lifetime with this number of steps. */
export function chooseSpeed(steps) {
  return (
    SPEEDS.findLast((speed) => steps / (speed * STEPS_PER_SECOND) >= MIN_DURATION) ?? SPEEDS[0]
  );
}

export class Player {
  /**
   * @param {(time: number) => boolean} show draws a moment. It returns false if the moment is not
   *   loaded; the time then waits.
   */
  constructor(show) {
    this.show = show;
    // In steps, with fractions.
    this.time = 0;
    // The last step.
    this.last = 0;
    this.speed = 10;
    // Steps per second that can be loaded.
    this.maxPace = Infinity;
    this.playing = false;
    this.changed = () => {};
    // Called after the last step.
    /** @type {(value?: any) => void} */
    this.ended = () => {};
    // Minimum time between two pictures, in milliseconds.
    this.frameInterval = 0;
    this.frameRequest = 0;
    this.lastFrame = 0;
  }

  /** Steps per second at the current speed. */
  get pace() {
    return this.speed * STEPS_PER_SECOND;
  }

  /** Draw in the next frame. */
  invalidate() {
    this.frameRequest ||= requestAnimationFrame((now) => this.drawFrame(now));
  }

  drawFrame(now) {
    this.frameRequest = 0;
    // Browsers round the time of a frame to a millisecond.
    if (this.lastFrame && now - this.lastFrame < this.frameInterval - 2) return this.invalidate();
    // A page that was hidden does not jump ahead.
    const elapsed = this.lastFrame ? Math.min(now - this.lastFrame, 100) : 0;
    this.lastFrame = this.playing ? now : 0;
    const isLoaded = this.show(this.time);
    if (!this.playing) return;
    if (isLoaded) {
      const pace = Math.min(this.pace, this.maxPace);
      this.time = Math.min(this.time + (elapsed / 1000) * pace, this.last);
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
    this.lastFrame = 0;
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

  /** Play or pause, because the user asks for it. */
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
  step(offset) {
    this.pause();
    this.seek(Math.floor(this.time) + offset);
  }

  setSpeed(speed) {
    this.speed = SPEEDS.includes(Number(speed)) ? Number(speed) : 10;
    this.changed();
  }

  /** Select the next higher or lower speed. */
  changeSpeed(offset) {
    const index = SPEEDS.indexOf(this.speed) + offset;
    this.setSpeed(SPEEDS[Math.min(Math.max(0, index), SPEEDS.length - 1)]);
  }

  close() {
    cancelAnimationFrame(this.frameRequest);
    this.playing = false;
  }
}
