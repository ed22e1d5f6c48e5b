/** The time bar: playback, steps, meals and speed of a player, with keyboard control. */

import {
  createButton,
  createIcon,
  createIconButton,
  createSelect,
  el,
  formatNumber,
  setText,
} from "../core/common.js";
import { handleKey, listTimeActions } from "../core/keys.js";
import { SPEEDS } from "./player.js";
import { Timeline } from "./timeline.js";

const PLAY = "M6 4l10 6-10 6z";
const PAUSE = "M7 4v12M13 4v12";
const BACK = "M12 5l-6 5 6 5zM15 5v10";
const FORWARD = "M8 5l6 5-6 5zM5 5v10";
// The steps of an arrow key with Shift.
const LONG_STEP = 10;

/** The parts of the bar. Its owner places them. */
export class TimeBar {
  /**
   * @param {import("./player.js").Player} player
   * @param {string} [testid] prefix of the test ids
   * @param {() => void} [onUserAction] called before the user plays, pauses or moves
   */
  constructor(player, testid = "", onUserAction = () => {}) {
    this.player = player;
    this.onUserAction = onUserAction;
    this.play = createButton("", () => this.act(() => player.toggle()), {
      class: "primary round",
      "data-testid": `${testid}play`,
    });
    const createStep = (name, label, path, offset) =>
      createIconButton(label, path, () => this.act(() => player.step(offset)), {
        class: "quiet square stepper",
        "data-testid": `${testid}${name}`,
      });
    this.back = createStep("back", "One step back (←)", BACK, -1);
    this.forward = createStep("on", "One step forward (→)", FORWARD, 1);
    this.timeline = new Timeline((step) => this.act(() => player.seek(step)));
    this.clock = el("span", { class: "clock number", "data-testid": `${testid}step` });
    this.speed = createSelect(
      SPEEDS.map((speed) => [speed, `${speed}×`]),
      player.speed,
      (speed) => player.setSpeed(speed),
      { "aria-label": "Speed", "data-testid": `${testid}speed` },
    );
    this.showTime();
  }

  /** Return all parts in a row. */
  createRow() {
    return el(
      "div",
      { class: "time-bar", role: "group", "aria-label": "Time" },
      this.play,
      this.back,
      this.forward,
      this.timeline.root,
      this.clock,
      this.speed,
    );
  }

  act(action) {
    this.onUserAction();
    action();
  }

  /** Show the state and the speed of the player. */
  showTime() {
    const { playing, speed } = this.player;
    const action = playing ? "Pause" : "Play";
    this.play.setAttribute("aria-label", action);
    this.play.title = `${action} (space)`;
    this.play.dataset.playing = String(playing);
    this.play.replaceChildren(createIcon(playing ? PAUSE : PLAY));
    this.speed.value = String(speed);
  }

  /**
   * Show a step, and the meals of the shown lifetimes.
   * @param {number} step
   * @param {import("./timeline.js").Track[]} [tracks]
   */
  draw(step, tracks = []) {
    const { last } = this.player;
    this.timeline.setLast(last);
    this.timeline.draw(tracks);
    this.timeline.show(step);
    setText(this.clock, `${formatNumber(step)} / ${formatNumber(last)}`);
  }

  /** Handle a key: Space plays and pauses, arrows move. */
  handleKey(event) {
    const actions = Object.entries(listTimeActions(event, this.player, LONG_STEP)).map(
      ([key, action]) => [key, () => this.act(action)],
    );
    handleKey(event, this.timeline.slider, Object.fromEntries(actions));
  }
}
