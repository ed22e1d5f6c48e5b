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
import { SPEEDS } from "./player.js";
import { ChartSlider } from "../charts/chart_slider.js";
import { palette } from "../core/palette.js";

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
   * @param {Track[]} [tracks]
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

/** Return the actions of the keys that control the time. With Shift, an arrow is `longStep` steps. */
export function listTimeActions({ shiftKey }, player, longStep) {
  const distance = shiftKey ? longStep : 1;
  return {
    " ": () => player.toggle(),
    ArrowLeft: () => player.step(-distance),
    ArrowRight: () => player.step(distance),
  };
}

/**
 * Run the action of a key, unless the focused element uses the key.
 * @param {KeyboardEvent} event
 * @param {HTMLElement|undefined} slider its keys control the complete view
 * @param {Object<string, () => void>} actions by key
 */
export function handleKey(event, slider, actions) {
  if (
    event.ctrlKey ||
    event.metaKey ||
    event.altKey ||
    !Object.hasOwn(actions, event.key) ||
    usesKey(event, slider)
  )
    return;
  event.preventDefault();
  actions[event.key]();
}

/** Return whether the focused element uses this key itself. */
function usesKey({ target, key }, slider) {
  if (target.matches?.("select, textarea, input:not([type=range], [type=checkbox])")) return true;
  if (target.matches?.("button, a, summary, input[type=checkbox]")) return key === " ";
  return (
    target.matches?.("input[type=range]") && target !== slider && /^(Arrow|Home|End|Page)/.test(key)
  );
}

// CSS pixels of a bar.
const BAR_WIDTH = 3;

/**
 * @typedef {object} Track
 * @property {import("./recording.js").Life} life
 * @property {number|null} agent whose meals are marked
 */
class Timeline extends ChartSlider {
  /** @param {(step: number) => void} seek */
  constructor(seek) {
    super("timeline", {
      max: 1,
      "aria-label": "Step",
      "data-testid": "timeline",
      oninput: () => seek(Number(this.slider.value)),
    });
    this.tracks = [];
  }

  describeAt(share) {
    const steps = Number(this.slider.max) + 1;
    const first = Math.floor(Math.min(Math.max(0, share * steps), steps - 1));
    const perBar = (BAR_WIDTH * steps) / Math.max(1, this.canvas.clientWidth);
    const last = Math.min(steps - 1, Math.max(first, Math.floor(first + perBar) - 1));
    const span = first === last
      ? `step ${formatNumber(first)}`
      : `steps ${formatNumber(first)} to ${formatNumber(last)}`;
    if (!this.tracks.length) return span;
    const eaten = this.tracks.map(({ life }) => formatNumber(countEaten(life, first, last)));
    return `${span}: ${eaten.join(" and ")} items eaten`;
  }

  /** Draw the meals, one row per track, if something has changed. */
  draw(tracks) {
    this.tracks = tracks;
    this.root.classList.toggle("plain", !tracks.length);
    const steps = Number(this.slider.max) + 1;
    const sheet = this.redrawIfChanged(
      steps,
      ...tracks.flatMap(({ life, agent }) => [
        life,
        agent,
        [...life.parts.keys()].join(),
      ]),
    );
    if (!sheet) return;
    const { pen, width, height, pixelRatio } = sheet;
    const row = height / tracks.length;
    tracks.forEach((track, number) =>
      drawTrack(pen, track, { top: number * row, width, row, pixelRatio, steps })
    );
  }
}

/** Return the number of items eaten in some steps, in loaded parts. */
function countEaten(life, from, to) {
  let sum = 0;
  for (const part of life.parts.values()) {
    for (let step = Math.max(from, part.first); step <= Math.min(to, part.last - 1); step++)
      sum += part.meals[step - part.first];
  }
  return sum;
}

function drawTrack(pen, { life, agent }, { top, width, row, pixelRatio, steps }) {
  const barWidth = BAR_WIDTH * pixelRatio;
  const bars = new Float32Array(Math.ceil(width / barWidth));
  const selectedBars = new Set();
  for (const part of life.parts.values()) {
    const barAt = (step) => Math.floor(((step / steps) * width) / barWidth);
    part.meals.forEach((count, index) => (bars[barAt(part.first + index)] += count));
    const isShown = agent !== null && agent < part.agents;
    for (let step = part.first + 1; isShown && step <= part.last; step++) {
      if (part.countEaten(step, agent) > part.countEaten(step - 1, agent))
        selectedBars.add(barAt(step - 1));
    }
  }
  const maximum = Math.max(4, ...bars);
  const barHeight = row - 4 * pixelRatio;
  pen.fillStyle = palette.edge;
  pen.globalAlpha = 0.6;
  pen.fillRect(0, top + row - pixelRatio, width, pixelRatio);
  bars.forEach((count, index) => {
    if (!count) return;
    const barTop = Math.max(
      2 * pixelRatio,
      Math.sqrt(count / maximum) * barHeight * (selectedBars.size ? 0.72 : 1),
    );
    pen.globalAlpha = 0.75;
    pen.fillStyle = palette.meal;
    pen.fillRect(index * barWidth, top + row - pixelRatio - barTop, barWidth - pixelRatio, barTop);
  });
  pen.globalAlpha = 1;
  pen.fillStyle = palette.chosen;
  for (const index of selectedBars)
    pen.fillRect(index * barWidth, top + pixelRatio, barWidth - pixelRatio, 5 * pixelRatio);
}
