/** The time bar of a world: playback, steps, meals and speed, with keyboard control. */

import { createIconButton, el, formatNumber } from "./common.js";
import { createPlayButton, createSpeedList, showPlaying } from "./player_controls.js";
import { Timeline } from "./timeline.js";

const BACK = "M12 5l-5 5 5 5";
const FORWARD = "M8 5l5 5-5 5";

export class TimeBar {
  /**
   * @param {import("./player.js").Player} player
   * @param {string} testid prefix of the test ids
   * @param {() => void} [onUserAction] called before the user plays, pauses or moves
   */
  constructor(player, testid, onUserAction = () => {}) {
    this.player = player;
    this.onUserAction = onUserAction;
    const userAction = (action) => () => {
      onUserAction();
      action();
    };
    const button = (name, label, path, action) =>
      createIconButton(label, path, userAction(action), {
        class: "square",
        title: null,
        "data-testid": `${testid}-${name}`,
      });
    this.toggle = createPlayButton(`${testid}-play`, userAction(() => player.toggle()));
    this.timeline = new Timeline((step) => userAction(() => player.seek(step))());
    this.step = el("span", { class: "number", "data-testid": `${testid}-step` });
    this.speed = createSpeedList(player, `${testid}-speed`);
    const back = button("back", "One step back", BACK, () => player.step(-1));
    const forward = button("on", "One step forward", FORWARD, () => player.step(1));
    this.root = el(
      "div",
      { class: "time-bar", role: "group", "aria-label": "Time" },
      this.toggle,
      back,
      forward,
      this.timeline.root,
      this.step,
      this.speed,
    );
    this.showTime();
  }

  showTime() {
    const { playing, speed } = this.player;
    showPlaying(this.toggle, playing);
    this.speed.value = String(speed);
  }

  /**
   * @param {import("./timeline.js").Track[]} tracks of the lifetimes, with at most `steps` steps
   */
  draw(step, steps, tracks) {
    this.timeline.setLast(steps - 1);
    this.timeline.draw(tracks);
    this.timeline.show(step);
    const text = `step ${formatNumber(step)} of ${formatNumber(steps)}`;
    if (this.step.textContent !== text) this.step.textContent = text;
  }

  /** Handle a key: Space plays and pauses, arrows move one step, with Shift ten. */
  handleKey(event) {
    const isHandled = event.target.matches("input, select, textarea") ||
      (event.key === " " && event.target.matches("button, summary, a"));
    if (isHandled || event.ctrlKey || event.metaKey || event.altKey) return;
    const offset = { ArrowLeft: -1, ArrowRight: 1 }[event.key];
    if (event.key !== " " && !offset) return;
    event.preventDefault();
    this.onUserAction();
    if (offset) this.player.step(event.shiftKey ? 10 * offset : offset);
    else this.player.toggle();
  }
}
