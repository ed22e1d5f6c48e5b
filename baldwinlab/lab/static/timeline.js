/** The timeline: a slider over a lifetime, with what was eaten when. */

import { el } from "./common.js";
import { palette } from "./palette.js";
import { Tip } from "./tip.js";

const BAR = 3; // CSS pixels a bar of meals
const THUMB = 16;

/**
 * @typedef {object} Track
 * @property {import("./recording.js").Lifetime} life
 * @property {number|null} chosen an agent whose meals are marked
 */
export class Timeline {
  /** @param {(step: number) => void} seek */
  constructor(seek) {
    this.canvas = el("canvas", { "aria-hidden": "true" });
    this.slider = el("input", {
      type: "range",
      min: 0,
      max: 1,
      step: 1,
      value: 0,
      "aria-label": "Step",
      "data-testid": "timeline",
      oninput: () => seek(Number(this.slider.value)),
    });
    this.root = el("div", { class: "timeline" }, this.canvas, this.slider);
    this.tip = new Tip(this.root);
    this.slider.addEventListener("pointermove", (event) => event.pointerType === "mouse" && this.tip.show(this.about(event.offsetX), event.offsetX, 0));
    this.slider.addEventListener("pointerleave", () => this.tip.show(null));
    this.key = [];
    this.tracks = [];
  }

  setLast(last) {
    this.slider.max = last;
  }

  /** Move the slider to a step. */
  show(step) {
    if (this.slider.valueAsNumber !== step) this.slider.value = step;
  }

  /** What is eaten at a place of the slider, which is wider than its canvas by half a thumb at each end. */
  about(x) {
    const steps = Number(this.slider.max) + 1;
    const perPixel = steps / Math.max(1, this.canvas.clientWidth);
    const first = Math.floor(Math.min(Math.max(0, (x - THUMB / 2) * perPixel), steps - 1));
    const last = Math.min(steps - 1, Math.max(first, Math.floor(first + BAR * perPixel) - 1));
    const eaten = this.tracks.map(({ life }) => eatenIn(life, first, last).toLocaleString("en"));
    const when = first === last ? `step ${first.toLocaleString("en")}` : `steps ${first.toLocaleString("en")} to ${last.toLocaleString("en")}`;
    return `${when}: ${eaten.join(" and ")} eaten`;
  }

  /** Draw the meals, one row a track; nothing is done where nothing has changed. */
  draw(tracks) {
    const dots = Math.min(devicePixelRatio || 1, 2);
    const [width, height] = [this.canvas.clientWidth * dots, this.canvas.clientHeight * dots];
    this.tracks = tracks;
    const steps = Number(this.slider.max) + 1;
    const key = [width, height, steps, palette.map, ...tracks.flatMap(({ life, chosen }) => [life, chosen, [...life.parts.keys()].join()])];
    if (key.length === this.key.length && key.every((value, at) => value === this.key[at])) return;
    this.key = key;
    this.canvas.width = Math.max(1, width);
    this.canvas.height = Math.max(1, height);
    const pen = this.canvas.getContext("2d");
    const row = height / tracks.length;
    tracks.forEach((track, number) => drawTrack(pen, track, { top: number * row, width, row, dots, steps }));
  }
}

/** Items that all agents eat from a step to another, both of them; of parts that are not here, nothing. */
function eatenIn(life, from, to) {
  let sum = 0;
  for (const part of life.parts.values()) {
    for (let step = Math.max(from, part.first); step <= Math.min(to, part.last - 1); step++) sum += part.meals[step - part.first];
  }
  return sum;
}

function drawTrack(pen, { life, chosen }, { top, width, row, dots, steps }) {
  const wide = BAR * dots;
  const bars = new Float32Array(Math.ceil(width / wide));
  const own = new Set();
  for (const part of life.parts.values()) {
    const place = (step) => Math.floor(((step / steps) * width) / wide);
    part.meals.forEach((count, at) => (bars[place(part.first + at)] += count));
    for (let step = part.first + 1; chosen !== null && step <= part.last; step++) {
      if (part.eatenBefore(step, chosen) > part.eatenBefore(step - 1, chosen)) own.add(place(step - 1));
    }
  }
  const most = Math.max(4, ...bars);
  const room = row - 4 * dots;
  pen.fillStyle = palette.edge;
  pen.globalAlpha = 0.6;
  pen.fillRect(0, top + row - dots, width, dots);
  bars.forEach((count, at) => {
    if (!count) return;
    const high = Math.max(2 * dots, Math.sqrt(count / most) * room * (own.size ? 0.72 : 1));
    pen.globalAlpha = 0.75;
    pen.fillStyle = palette.meal;
    pen.fillRect(at * wide, top + row - dots - high, wide - dots, high);
  });
  pen.globalAlpha = 1;
  pen.fillStyle = palette.chosen;
  for (const at of own) pen.fillRect(at * wide, top + dots, wide - dots, 5 * dots);
}
