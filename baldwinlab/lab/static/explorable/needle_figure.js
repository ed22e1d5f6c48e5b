/** The needle: recorded points, and the line of the theory, by the period of the changes. */

import { el, formatNumber } from "../core/common.js";
import { chooseTicks, createSvg, drawGridRow, drawTextLabel } from "../core/drawing.js";
import { Figure } from "./figure.js";

const MARGIN = { left: 48, right: 8, top: 12, bottom: 48 };
// Pixels between the edges and the outer points.
const INSET = 12;
const MAX_SHARE = 0.5;
// Points of the line between two recorded periods.
const LINE_POINTS = 6;

export class NeedleFigure extends Figure {
  constructor(root, context) {
    super(root, context);
    const title = el("div", { class: "chart-title" }, this.strings.needle_title);
    this.svg = createSvg("svg", {
      role: "img",
      "aria-label": this.strings.needle_title,
      class: "needle",
    });
    root.append(title, this.svg, this.createLegend());
    new ResizeObserver(() => this.draw()).observe(this.svg);
  }

  createLegend() {
    const { needle_point: point, needle_line: line } = this.strings;
    const createKey = (name, text) =>
      el("span", {}, el("span", { class: `key ${name}`, "aria-hidden": "true" }), text);
    return el("div", { class: "legend" }, createKey("point", point), createKey("line", line));
  }

  // The picture moves only with the dials, so it has no button.
  showButton() {}

  restart() {
    this.draw();
  }

  async play() {}

  get cost() {
    return this.data.needle.costs[this.dials.read("cost")];
  }

  computeTheory(period) {
    const { loci, trials, mutation_rate: mutationRate, redrawn_loci: redrawnLoci } =
      this.data.needle;
    return computeBalance({ loci, trials, cost: this.cost, mutationRate, period, redrawnLoci });
  }

  /** Return the position of a period, whose axis is logarithmic. */
  placeX(period) {
    const { periods } = this.data.needle;
    const share = Math.log(period / periods[0]) / Math.log(periods.at(-1) / periods[0]);
    return MARGIN.left + INSET + share * (this.right - MARGIN.left - 2 * INSET);
  }

  placeY(share) {
    return MARGIN.top + (1 - share / MAX_SHARE) * (this.bottom - MARGIN.top);
  }

  draw() {
    // One unit is one pixel, so that texts keep their size.
    this.right = this.svg.clientWidth - MARGIN.right;
    this.bottom = this.svg.clientHeight - MARGIN.bottom;
    const { periods } = this.data.needle;
    const chosen = this.dials.read("period");
    const points = this.data.recordings.needle[this.dials.read("cost")];
    const x = this.placeX(periods[chosen]);
    const marker = createSvg("line", {
      class: "chosen-period",
      x1: x,
      x2: x,
      y1: MARGIN.top,
      y2: this.bottom,
    });
    const circles = points.flatMap((runs, index) =>
      runs.map((share) =>
        createSvg("circle", {
          class: index === chosen ? "point chosen" : "point",
          cx: this.placeX(periods[index]),
          cy: this.placeY(share),
          r: 5,
        })
      )
    );
    this.svg.replaceChildren(...this.drawAxes(), marker, this.drawLine(), ...circles);
    this.setValue("theory", formatShare(this.computeTheory(periods[chosen])));
    this.setValue("points", points[chosen].map(formatShare).join(", "));
  }

  drawLine() {
    const { periods } = this.data.needle;
    const corners = [];
    for (let index = 0; index < periods.length - 1; index++)
      for (let part = 0; part < LINE_POINTS; part++)
        corners.push(
          periods[index] * (periods[index + 1] / periods[index]) ** (part / LINE_POINTS),
        );
    corners.push(periods.at(-1));
    const path = corners.map(
      (period) => `${this.placeX(period)},${this.placeY(this.computeTheory(period))}`,
    );
    return createSvg("polyline", { class: "theory", points: path.join(" ") });
  }

  drawAxes() {
    const rows = chooseTicks(0, MAX_SHARE).flatMap((share) =>
      drawGridRow(formatShare(share), MARGIN.left, this.right, this.placeY(share))
    );
    const columns = this.data.needle.periods.map((period) =>
      drawTextLabel(formatNumber(period), this.placeX(period), this.bottom + 18, "middle")
    );
    const middle = (MARGIN.left + this.right) / 2;
    const bottom = this.bottom + MARGIN.bottom - 8;
    const label = drawTextLabel(this.strings.needle_x, middle, bottom, "middle");
    return [...rows, ...columns, label];
  }
}

function formatShare(share) {
  return `${Math.round(100 * share)} %`;
}

// Maximum gain in fitness above the baseline of 1.
const MAX_GAIN = 19;
// Halvings of the interval of the root, down to the precision of a number.
const HALVINGS = 60;

/** Return the mean fitness of a string with `unset` open switches and no wrong one. */
function computeExpectedFitness(unset, { trials, cost }) {
  const success = 0.5 ** unset;
  let fitness = 1;
  // The probability that the first success is this trial.
  let probability = success;
  for (let trial = 1; trial <= trials; trial++) {
    fitness += probability * MAX_GAIN * Math.max(0, 1 - (cost * trial) / trials);
    probability *= 1 - success;
  }
  return fitness;
}

/** Return the relative gain in fitness if one open switch becomes right. */
function computeSelection(unset, settings) {
  const count = Math.max(unset, 1);
  const fitness = computeExpectedFitness(count, settings);
  return (computeExpectedFitness(count - 1, settings) - fitness) / fitness;
}

/**
 * Return the share of open switches at which mutation, change and selection balance.
 * @param {{loci: number, trials: number, cost: number, mutationRate: number, period: number,
 *   redrawnLoci: number}} settings
 */
export function computeBalance(settings) {
  const { loci, mutationRate, period, redrawnLoci } = settings;
  const gain = mutationRate / 3 + redrawnLoci / (2 * loci * period);
  const loss = mutationRate / 3;
  if (gain === 0) return 0;
  const computeSurplus = (share) =>
    (1 - share) * gain - share * (computeSelection(share * loci, settings) + loss);
  // The first root is that of populations that have found the needle.
  let high = 0;
  for (let locus = 0; locus <= loci; locus++) {
    high = locus / loci;
    if (computeSurplus(high) <= 0) break;
  }
  let low = 0;
  for (let halving = 0; halving < HALVINGS; halving++) {
    const middle = (low + high) / 2;
    if (computeSurplus(middle) > 0) low = middle;
    else high = middle;
  }
  return (low + high) / 2;
}
