/** The timeline: a slider over a lifetime, with bars for meals. */

import { ChartSlider } from "../charts/chart_slider.js";
import { formatNumber } from "../core/common.js";
import { palette } from "../core/palette.js";

// CSS pixels of a bar.
const BAR_WIDTH = 3;

/**
 * @typedef {object} Track
 * @property {import("./recording.js").Life} life
 * @property {number|null} agent whose meals are marked
 */
export class Timeline extends ChartSlider {
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
