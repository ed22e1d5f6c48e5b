/** Two worlds with one time bar: agents that learn next to agents that cannot. */

import { el } from "./common.js";
import { Player } from "./player.js";
import { TimeBar } from "./time_bar.js";
import { WorldFigure } from "./world_figure.js";

export const LABELS = ["With learning", "Without learning"];

export class WorldPair {
  /** @param {string} testid prefix of the test ids */
  constructor(testid) {
    this.lives = [];
    this.player = new Player((time) => this.draw(time));
    this.bar = new TimeBar(this.player, testid);
    this.player.changed = () => this.bar.showTime();
    this.figures = LABELS.map(
      (label, index) =>
        new WorldFigure(label, `${testid}-${"ab"[index]}`, {
          invalidate: () => this.player.invalidate(),
        }),
    );
    this.root = el(
      "div",
      { class: "contrast-worlds" },
      this.figures.map(({ stage, count }, index) =>
        el(
          "figure",
          {},
          stage,
          el("figcaption", {}, el("strong", {}, LABELS[index]), " · ", count),
        )
      ),
    );
  }

  /** Show two recordings of complete lifetimes, or of their first steps. */
  show(lives) {
    this.lives = lives;
    this.figures.forEach((figure, index) => figure.show(lives[index]));
  }

  /** The first step at which an agent eats, or Infinity. */
  get firstMeal() {
    const steps = this.lives.map((life) =>
      life.findPart(0).meals.findIndex((/** @type {number} */ count) => count > 0)
    );
    return Math.min(...steps.map((step) => (step < 0 ? Infinity : step)));
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
