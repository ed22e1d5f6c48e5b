/** Worlds with one time bar. */

import { Player } from "./player.js";
import { TimeBar } from "./time_bar.js";
import { WorldFigure } from "./world_figure.js";

export class WorldGroup {
  /**
   * @param {string} testid prefix of the test ids of the time bar
   * @param {string[][]} worlds the label and the test id of each world
   */
  constructor(testid, worlds) {
    this.lives = [];
    this.player = new Player((time) => this.draw(time));
    this.bar = new TimeBar(this.player, testid);
    this.player.changed = () => this.bar.showTime();
    const invalidate = () => this.player.invalidate();
    this.figures = worlds.map(([label, id]) => new WorldFigure(label, id, { invalidate }));
  }

  /** Show recordings of complete lifetimes, or of their first steps. */
  show(lives) {
    this.lives = lives;
    this.figures.forEach((figure, index) => figure.show(lives[index]));
  }

  draw(time) {
    const isComplete = this.figures.map((figure) => figure.draw(time).ready);
    const tracks = this.lives.map((life, index) => ({
      life,
      selectedAgent: this.figures[index].agent,
    }));
    if (tracks.length) this.bar.draw(Math.floor(time), this.player.last + 1, tracks);
    if (isComplete.includes(false)) this.player.invalidate();
    return true;
  }

  close() {
    this.player.close();
    for (const figure of this.figures) figure.close();
  }
}
