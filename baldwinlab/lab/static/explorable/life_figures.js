/** The first picture: agents that look for food. One of them has a ring. */

import { el } from "../core/common.js";
import { createPlayer, Figure } from "./figure.js";
import { findMiddleAgent, MapView } from "./map_view.js";

// Speed of the player at normal speed.
const LIFE_SPEED = 10;
// The step of a still picture, as a share of a lifetime.
const STILL_SHARE = 0.6;

export class AgentFigure extends Figure {
  constructor(root, context) {
    super(root, context);
    this.player = createPlayer((time) => this.draw(time));
    this.setSpeed(this.speed);
    // The same life again, or a live one after the recorded one.
    this.player.ended = () => this.play();
    const { strings, data } = this;
    const invalidate = () => this.player.invalidate();
    this.map = new MapView(strings, strings.map_part, invalidate, data.region);
    root.append(el("div", { class: "maps" }, this.map.root), this.bar);
    matchMedia("(prefers-color-scheme: dark)").addEventListener(
      "change",
      () => this.player.invalidate(),
    );
    this.isFirstLife = true;
  }

  setSpeed(speed) {
    super.setSpeed(speed);
    this.player.speed = LIFE_SPEED * speed;
  }

  onPlaying(isPlaying) {
    if (isPlaying && this.map.recording) this.player.play();
    else this.player.pause();
  }

  /** Show the last step, and wait there. */
  skip() {
    if (this.map.recording) this.player.seek(this.player.last);
    this.wantsPlay = false;
    this.update();
  }

  async run() {
    const round = this.round;
    const recording = await this.loadLife();
    if (round === this.round) this.show(recording);
  }

  /** The first life is recorded, so that it plays at once. A live one follows. */
  async loadLife() {
    if (this.isFirstLife) {
      this.isFirstLife = false;
      return this.recorded.loadLife("learning");
    }
    return this.source.recordLearners({
      "senses.visual_radius": this.dials.read("visual_radius"),
      "world.food.0.count": this.dials.read("food"),
    });
  }

  show(recording) {
    this.map.show(recording, findMiddleAgent(recording));
    this.player.last = recording.last - 1;
    this.player.time = 0;
    this.player.invalidate();
    this.onPlaying(this.isPlaying);
  }

  draw(time) {
    this.map.draw(time);
    const { recording, agent } = this.map;
    if (recording)
      this.setValue("ring_items", String(recording.countEaten(Math.floor(time) + 1, agent)));
    return true;
  }

  showStill() {
    const recording = this.recorded.lives.get("learning");
    if (this.isNew && recording) this.show(recording);
    if (this.isPlaying || !this.map.recording) return;
    this.player.time = Math.floor(this.player.last * STILL_SHARE);
    this.draw(this.player.time);
  }
}
