/** Time: it stands, or goes on at some steps a second, and whoever shows it is told before every frame. */

export const SPEEDS = [1, 2, 5, 10, 20, 50, 100, 200, 500, 1000];
const STEPS_A_SECOND = 10; // at speed 1
const WHOLE_LIFE = 6; // seconds that a life takes at least, at its usual speed

/** The speed at which a life of so many steps is seen in some seconds, so that something happens. */
export function defaultSpeed(steps) {
  return SPEEDS.findLast((speed) => steps / (speed * STEPS_A_SECOND) >= WHOLE_LIFE) ?? SPEEDS[0];
}

export class Player {
  /** @param {(time: number) => boolean} show draws a moment; false: it is not there yet, so time waits */
  constructor(show) {
    this.show = show;
    this.time = 0; // in steps, with fractions between them
    this.last = 0; // the last step there is
    this.speed = 10;
    this.playing = false;
    this.changed = () => {};
    this.ended = () => {}; // has played to the last step
    this.asked = 0;
    this.before = 0;
  }

  /** Draw at the next frame. */
  invalidate() {
    this.asked ||= requestAnimationFrame((now) => this.frame(now));
  }

  frame(now) {
    this.asked = 0;
    const elapsed = this.before ? Math.min(now - this.before, 100) : 0; // a page that was hidden does not leap
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

  /** Play by itself, unless the reader wants nothing to move. */
  autoplay() {
    if (!matchMedia("(prefers-reduced-motion: reduce)").matches) this.play();
  }

  /** From the beginning, where the end has been reached. */
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

  /** Go to a step; playing goes on from there. */
  seek(step) {
    this.time = Math.min(Math.max(0, step), this.last);
    this.changed();
    this.invalidate();
  }

  /** Stop, and go some steps on or back. */
  step(by) {
    this.pause();
    this.seek(Math.floor(this.time) + by);
  }

  setSpeed(speed) {
    this.speed = SPEEDS.includes(Number(speed)) ? Number(speed) : 10;
    this.changed();
  }

  /** The next speed up or down. */
  changeSpeed(by) {
    const at = SPEEDS.indexOf(this.speed) + by;
    this.setSpeed(SPEEDS[Math.min(Math.max(0, at), SPEEDS.length - 1)]);
  }

  close() {
    cancelAnimationFrame(this.asked);
    this.playing = false;
  }
}
