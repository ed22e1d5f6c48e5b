/** A lifetime on a grid of cells: agent, items and path, step by step. */

import { el, formatNumber, setText } from "../core/common.js";
import { createLegendEntry } from "./legend.js";
import { formatColor, palette, resolveColor } from "../core/palette.js";
import { chooseSpeed, Player } from "./player.js";
import { TimeBar } from "./time_bar.js";

// By heading.
const DIRECTIONS = ["right", "down", "left", "up"];

export class GridView {
  /** @param {() => void} onStep called when another step is shown */
  constructor(onStep) {
    this.onStep = onStep;
    this.player = new Player((time) => this.draw(Math.floor(time)));
    this.bar = new TimeBar(this.player, "grid-");
    this.player.changed = () => this.changed();
    this.heading = el("h2", { "data-testid": "view-heading" });
    this.legend = el("div", { class: "legend", role: "group", "aria-label": "Legend" });
    this.canvas = el("canvas", {
      role: "img",
      "aria-label": "The lifetime, described below",
      "data-testid": "grid",
    });
    this.description = el("p", { class: "number", "data-testid": "grid-description" });
    this.stage = el("div", { class: "grid-stage" }, this.canvas);
    this.root = el(
      "div",
      { class: "view" },
      el("div", { class: "row" }, this.heading, this.legend),
      this.stage,
      this.bar.createRow(),
      this.description,
    );
    this.sized = new ResizeObserver(() => this.player.invalidate());
    this.sized.observe(this.canvas);
  }

  clear() {
    this.player.pause();
    this.life = null;
    this.heading.textContent = this.description.textContent = "";
    this.canvas.hidden = true;
    this.legend.replaceChildren();
  }

  /** Set the data. The current step stays the same if the lifetime has it. */
  setData(header, arrays, title) {
    const [
      {
        shape: [steps, rows, columns],
      },
    ] = header.arrays;
    const first = !this.life;
    this.title = title;
    this.life = { ...header, ...arrays, steps, rows, columns };
    this.canvas.hidden = false;
    this.canvas.style.aspectRatio = `${columns} / ${rows}`;
    const mark = (name, color, shape = "") =>
      createLegendEntry(name, { class: `grid-mark ${shape}`, style: `background: ${color}` });
    this.legend.replaceChildren(
      mark("agent", "var(--agent)", "round"),
      ...Object.entries(header.cell_colors).map(([name, color]) => mark(name, formatColor(color))),
    );
    Object.assign(this.player, {
      last: steps - 1,
      ...(first && { speed: Math.min(chooseSpeed(steps), 2) }),
    });
    this.player.seek(this.player.time);
  }

  show(generation) {
    this.heading.textContent = `${this.title}, generation ${generation}`;
  }

  get step() {
    return Math.floor(this.player.time);
  }

  changed() {
    this.bar.showTime();
    this.onStep();
  }

  draw(step) {
    const { life, canvas } = this;
    if (!life) return true;
    this.bar.draw(step);
    const text = this.describeStep(step);
    setText(this.description, text);
    this.bar.timeline.slider.setAttribute("aria-valuetext", text);
    const pixelRatio = Math.min(devicePixelRatio || 1, 2);
    canvas.width = Math.max(1, canvas.clientWidth * pixelRatio);
    canvas.height = Math.max(1, canvas.clientHeight * pixelRatio);
    const pen = canvas.getContext("2d");
    pen.scale(canvas.width / life.columns, canvas.height / life.rows);
    this.drawCells(pen, step);
    this.drawPath(pen, step);
    this.drawAgent(pen, step);
    if (this.player.playing) this.onStep();
    return true;
  }

  drawCells(pen, step) {
    const { cells, rows, columns, cell_colors } = this.life;
    const colors = Object.values(cell_colors).map(resolveColor);
    pen.fillStyle = palette.map;
    pen.fillRect(0, 0, columns, rows);
    for (let row = 0; row < rows; row++) {
      for (let column = 0; column < columns; column++) {
        const kind = cells[(step * rows + row) * columns + column];
        pen.fillStyle = kind ? colors[kind - 1] : palette.edge;
        if (kind) pen.fillRect(column + 0.1, row + 0.1, 0.8, 0.8);
        // A dot makes empty cells visible.
        else pen.fillRect(column + 0.46, row + 0.46, 0.08, 0.08);
      }
    }
  }

  /** Draw the path from the start of the visit to the current cell. */
  drawPath(pen, step) {
    const { position, visit } = this.life;
    pen.beginPath();
    for (let index = step; index >= 0 && visit[index] === visit[step]; index--)
      pen.lineTo(position[2 * index + 1] + 0.5, position[2 * index] + 0.5);
    Object.assign(pen, {
      strokeStyle: palette.trail,
      lineWidth: 0.1,
      lineJoin: "round",
      lineCap: "round",
      globalAlpha: 0.45,
    });
    pen.stroke();
    pen.globalAlpha = 1;
  }

  drawAgent(pen, step) {
    const { position, heading } = this.life;
    pen.save();
    pen.translate(position[2 * step + 1] + 0.5, position[2 * step] + 0.5);
    pen.fillStyle = palette.agent;
    pen.beginPath();
    if (heading[step] < 0) pen.arc(0, 0, 0.34, 0, 2 * Math.PI);
    else {
      pen.rotate((heading[step] * Math.PI) / 2);
      pen.moveTo(0.42, 0);
      pen.lineTo(-0.34, 0.32);
      pen.lineTo(-0.18, 0);
      pen.lineTo(-0.34, -0.32);
    }
    pen.fill();
    pen.restore();
  }

  describeStep(step) {
    const { visit, visit_label, steps, position, heading, gained } = this.life;
    const first = visit.indexOf(visit[step]);
    const end = visit.lastIndexOf(visit[step]);
    const facing = heading[step] < 0 ? "" : `, facing ${DIRECTIONS[heading[step] % 4]}`;
    return (
      `${visit_label} ${visit[step] + 1} of ${visit[steps - 1] + 1}, step ` +
      `${step - first + 1} of ${end - first + 1}: row ${position[2 * step] + 1}, ` +
      `column ${position[2 * step + 1] + 1}${facing}; gained ${formatNumber(gained[step])} ` +
      `in this ${visit_label} so far`
    );
  }

  close() {
    this.sized.disconnect();
    this.player.close();
  }
}
