/** What learning is: the two networks of one agent, and the lessons of its life. */

import { el, formatDecimals, setText } from "../core/common.js";
import { createSvg, drawTextLabel } from "../core/drawing.js";
import { RunFigure } from "./figure.js";
import { chooseAction, INPUTS, Learner, OUTPUTS } from "./lesson_model.js";

// Lessons between two pictures.
const LESSONS = 5;
// What an agent can sense, as inputs: nothing, or food on the left, ahead or on the right.
const SITUATIONS = { nothing: [0, 0, 0], left: [1, 0, 0], ahead: [0, 1, 0], right: [0, 0, 1] };
// The output whose numbers are in the text: turn right.
const SHOWN_OUTPUT = 2;
// The size of labels, as a share of the text of the page.
const LABEL_SIZE = 0.78;
// Columns, as shares of the width: inputs, hidden units, outputs, and bars.
const COLUMNS = { inputs: 0.24, hidden: 0.4, outputs: 0.56, bars: 0.6, end: 0.76 };
// The change of a weight that has the full color.
const FULL_CHANGE = 0.3;

export class LessonFigure extends RunFigure {
  constructor(root, context) {
    super(root, context);
    this.svg = createSvg("svg", { role: "img", class: "networks" });
    this.table = this.createTable();
    root.append(this.svg, this.table, this.bar);
    this.recording = null;
    this.interval = 40;
    new ResizeObserver(() => this.draw()).observe(this.svg);
  }

  createTable() {
    const { strings } = this;
    const head = [strings.senses, strings.born, strings.now].map((title) =>
      el("th", { scope: "col" }, title)
    );
    this.cells = Object.keys(SITUATIONS).map((name) => ({
      name,
      born: el("td"),
      now: el("td"),
    }));
    const rows = this.cells.map(({ name, born, now }) =>
      el("tr", {}, el("th", { scope: "row" }, strings[`senses_${name}`]), born, now)
    );
    return el("table", { class: "actions" }, el("thead", {}, el("tr", {}, head)), rows);
  }

  get actions() {
    return ["left", "ahead", "right"].map((name) => this.strings[`go_${name}`]);
  }

  async run(mayContinue) {
    const { round } = this;
    const recording = await this.loadLife();
    if (round !== this.round) return;
    this.recording = recording;
    await super.run(mayContinue);
  }

  loadLife() {
    if (this.dials.areUnchanged) return this.recorded.loadLife("learning");
    return this.source.recordLearners({ "learning.rate": this.dials.read("rate") });
  }

  start() {
    const { genome } = this.data.recordings.learner;
    this.learner = new Learner(genome, this.dials.read("rate"));
    this.generations = Math.floor(this.recording.last / LESSONS);
    this.lesson = 0;
  }

  advance() {
    const { agent } = this.data.recordings.learner;
    for (let count = 0; count < LESSONS; count++) {
      this.inputs = Array.from(
        { length: INPUTS },
        (_, input) => this.recording.readInput(this.lesson, agent, input),
      );
      this.outcome = this.learner.learn(this.inputs);
      this.lesson += 1;
    }
    this.showValues();
    this.draw();
  }

  showStill() {
    this.recording ??= this.recorded.lives.get("learning") ?? null;
    if (this.recording) super.showStill();
  }

  showValues() {
    const { before, after, target } = this.outcome;
    const format = (outputs) => formatDecimals(outputs[SHOWN_OUTPUT], 4);
    this.setValue("lesson", String(this.lesson));
    this.setValue("before", format(before));
    this.setValue("after", format(after));
    this.setValue("target", format(target));
    for (const { name, born, now } of this.cells) {
      const actions = [this.learner.born, this.learner.weights].map((weights) =>
        chooseAction(weights, SITUATIONS[name])
      );
      setText(born, this.actions[actions[0]]);
      setText(now, this.actions[actions[1]]);
      now.classList.toggle("learned", actions[0] !== actions[1]);
    }
  }

  draw() {
    const { clientWidth: width, clientHeight: height } = this.svg;
    if (!this.outcome || !width) return;
    this.size = LABEL_SIZE * Number.parseFloat(getComputedStyle(this.svg).fontSize);
    this.width = width;
    const { born, weights, teacher } = this.learner;
    const { after, target } = this.outcome;
    const { acting: actingTitle, teaching: teachingTitle } = this.strings;
    const acting = { weights, born, outputs: after, target, title: actingTitle };
    const teaching = { weights: teacher, born: teacher, outputs: target, title: teachingTitle };
    this.svg.replaceChildren(
      ...this.drawNetwork(acting, 0, height / 2),
      ...this.drawNetwork(teaching, height / 2, height / 2),
    );
    // On paper, the picture gets the width of the page.
    this.svg.setAttribute("viewBox", `0 0 ${width} ${height}`);
    this.svg.setAttribute("aria-label", `${actingTitle} ${teachingTitle}`);
  }

  /**
   * Draw a network: units, weights, and its outputs as bars with their targets.
   * @param {{weights: Float64Array, born: Float64Array, outputs: number[], target?: number[],
   *   title: string}} network
   * @param {number} top
   * @param {number} height
   */
  drawNetwork({ weights, born, outputs, target, title }, top, height) {
    const first = top + 2 * this.size;
    const placeRow = (index, count) => first + ((index + 0.5) / count) * (height - 2.5 * this.size);
    const hidden = weights.length / (INPUTS + OUTPUTS);
    const place = (column, count) =>
      Array.from({ length: count }, (_, row) => [
        COLUMNS[column] * this.width,
        placeRow(row, count),
      ]);
    const units = {
      inputs: place("inputs", INPUTS),
      hidden: place("hidden", hidden),
      outputs: place("outputs", OUTPUTS),
    };
    const drawLayer = (sources, targets, offset) =>
      sources.flatMap((source, row) =>
        targets.flatMap((end, column) => {
          const weight = offset + row * targets.length + column;
          return drawWeight(source, end, weights[weight], weights[weight] - born[weight]);
        })
      );
    const lit = (index) => (this.inputs[index] ? "unit lit" : "unit");
    return [
      this.drawLabel(title, 0, top + this.size, "start", "network-title"),
      ...drawLayer(units.inputs, units.hidden, 0),
      ...drawLayer(units.hidden, units.outputs, INPUTS * hidden),
      ...units.inputs.map(([x, y], index) => drawUnit(x, y, lit(index))),
      ...units.hidden.map(([x, y]) => drawUnit(x, y, "unit")),
      ...units.inputs.map(([x, y], index) =>
        this.drawLabel(this.strings[`food_${Object.keys(SITUATIONS)[index + 1]}`], x - 8, y, "end")
      ),
      ...units.outputs.flatMap(([x, y], output) => [
        drawUnit(x, y, "unit"),
        ...this.drawOutput(y, outputs[output], target?.[output]),
        this.drawLabel(
          this.actions[output],
          COLUMNS.end * this.width + 6,
          y,
          "start",
          outputs[output] === Math.max(...outputs) ? "chosen" : "",
        ),
      ]),
    ];
  }

  /** Draw an output as a bar, and the target as a line. */
  drawOutput(y, output, target) {
    const [left, length] = [COLUMNS.bars * this.width, (COLUMNS.end - COLUMNS.bars) * this.width];
    const bar = (share, kind) =>
      createSvg("rect", { class: kind, x: left, y: y - 5, width: share * length, height: 10 });
    const x = left + target * length;
    return [
      bar(1, "bar-frame"),
      bar(output, "bar"),
      ...(target === undefined
        ? []
        : [createSvg("line", { class: "target", x1: x, x2: x, y1: y - 9, y2: y + 9 })]),
    ];
  }

  drawLabel(text, x, y, anchor, kind = "") {
    const attributes = { "font-size": this.size, class: kind, opacity: 1 };
    return drawTextLabel(text, x, y + 0.35 * this.size, anchor, attributes);
  }
}

function drawUnit(x, y, kind) {
  return createSvg("circle", { class: kind, cx: x, cy: y, r: 5 });
}

/** Draw a weight as a line, and its change since birth in the color of learning above it. */
function drawWeight([x1, y1], [x2, y2], weight, change) {
  const width = Math.min(4, 0.4 + 1.2 * Math.abs(weight));
  const line = { x1, y1, x2, y2, "stroke-width": width };
  const share = Math.min(1, Math.abs(change) / FULL_CHANGE);
  const lines = [createSvg("line", { class: "weight", ...line })];
  if (share > 0.05)
    lines.push(createSvg("line", { class: "weight moved", ...line, "stroke-opacity": share }));
  return lines;
}
