/** The density of a large world: agents and items in each square of a window, and their legend. */

import { el } from "../core/common.js";
import { formatColor, palette, resolveColor } from "../core/palette.js";

// CSS pixels of the side of a square.
export const SQUARE_SIZE = 6;
// The smallest count of each color of agents.
const AGENT_CLASSES = [1, 2, 5, 10, 25, 50, 100];
// The smallest count of each size of dots, and the sizes in pixels. Agents remain visible around a
// dot.
const ITEM_CLASSES = [1, 10, 100];
const DOT_SIZES = [2, 3, 4];

/** Return the name of the color of a class of agents. */
function nameAgentColor(number) {
  return `density-${number + 1}`;
}

/** Return the class of a count: the index in the smallest counts, or -1 for none. */
function findClass(classes, count) {
  let number = -1;
  while (number + 1 < classes.length && count >= classes[number + 1]) number += 1;
  return number;
}

/** A picture of counts, which is painted once per frame and then scaled to the map. */
export class DensityLayer {
  constructor() {
    this.sheet = document.createElement("canvas");
  }

  /**
   * Paint the counts of a window, and draw the picture with a pen in map units.
   * @param {CanvasRenderingContext2D} pen
   * @param {import("./frame_stream.js").Window} window
   * @param {ArrayLike<number>|null} agents [square] null draws none
   * @param {{counts: ArrayLike<number>, color: string}[]} items [square] of each kind
   */
  draw(pen, window, agents, items) {
    const { left, top, right, bottom } = window;
    this.paint(window, agents, items);
    pen.imageSmoothingEnabled = false;
    pen.drawImage(this.sheet, left, top, right - left, bottom - top);
  }

  paint({ columns, rows }, agents, items) {
    const width = columns * SQUARE_SIZE;
    const height = rows * SQUARE_SIZE;
    const { sheet } = this;
    if (sheet.width !== width || sheet.height !== height) {
      Object.assign(sheet, { width, height });
      this.image = new ImageData(width, height);
      this.pixels = new Uint32Array(this.image.data.buffer);
    }
    // Empty squares are transparent.
    this.pixels.fill(0);
    if (agents) this.fillSquares(columns, agents);
    for (const { counts, color } of items) this.fillDots(columns, counts, parseColor(color));
    sheet.getContext("2d").putImageData(this.image, 0, 0);
  }

  fillSquares(columns, counts) {
    const colors = AGENT_CLASSES.map((_, number) => parseColor(palette[nameAgentColor(number)]));
    for (let square = 0; square < counts.length; square++) {
      if (!counts[square]) continue;
      const color = colors[findClass(AGENT_CLASSES, counts[square])];
      this.fill(columns, square, 0, SQUARE_SIZE, color);
    }
  }

  fillDots(columns, counts, color) {
    for (let square = 0; square < counts.length; square++) {
      if (!counts[square]) continue;
      const size = DOT_SIZES[findClass(ITEM_CLASSES, counts[square])];
      this.fill(columns, square, (SQUARE_SIZE - size) >> 1, size, color);
    }
  }

  /** Fill a part of a square: `size` pixels from `offset` in both directions. */
  fill(columns, square, offset, size, color) {
    const width = columns * SQUARE_SIZE;
    const column = square % columns;
    const row = (square - column) / columns;
    let start = (row * SQUARE_SIZE + offset) * width + column * SQUARE_SIZE + offset;
    for (let line = 0; line < size; line++, start += width)
      this.pixels.fill(color, start, start + size);
  }
}

/** Return "#rrggbb" as the number of an opaque pixel. */
function parseColor(name) {
  const rgb = parseInt(resolveColor(name).slice(1), 16);
  return (0xff000000 | ((rgb & 0xff) << 16) | (rgb & 0xff00) | (rgb >> 16)) >>> 0;
}

export class DensityLegend {
  /** @param {() => void} changed called when the user hides or shows agents or items */
  constructor(changed) {
    this.agents = createSwitch("density-agents", changed);
    this.items = createSwitch("density-items", changed);
    this.agentScale = createScale(AGENT_CLASSES, (number) => ({
      class: "density-square",
      style: `background: var(--${nameAgentColor(number)})`,
    }));
    this.itemScale = el("span", { class: "entries" });
    this.root = el(
      "div",
      {
        class: "density-legend number",
        role: "group",
        "aria-label": "Layers of the map",
        hidden: true,
        "data-testid": "density-legend",
      },
      el("span", { class: "density-layer" }, this.agents.root, this.agentScale),
      el("span", { class: "density-layer" }, this.items.root, this.itemScale),
    );
  }

  get showsAgents() {
    return this.agents.box.checked;
  }

  get showsItems() {
    return this.items.box.checked;
  }

  /**
   * @param {Object<string, any>} header
   * @param {import("./frame_stream.js").Frame|null} frame
   */
  show(header, frame) {
    this.root.hidden = false;
    const kinds = header.appearance.item_kinds;
    const key = kinds.map(({ name, color }) => name + color).join();
    if (key !== this.key) {
      this.key = key;
      this.itemScale.replaceChildren(...kinds.map(createItemScale));
    }
    const names = kinds.map(({ name }) => name).join(" and ") || "items";
    const unit = ` per square of ${SQUARE_SIZE} pixels`;
    this.agentScale.hidden = frame?.showsAgents ?? true;
    this.itemScale.hidden = !frame?.items.counts;
    this.agents.text.textContent = `agents${this.agentScale.hidden ? "" : unit}`;
    this.items.text.textContent = `${names}${this.itemScale.hidden ? "" : unit}`;
  }

  /** Hide the legend of a world without a density. */
  hide() {
    this.root.hidden = true;
  }
}

function createSwitch(testid, changed) {
  const box = el("input", { type: "checkbox", checked: true, "data-testid": testid });
  box.addEventListener("change", changed);
  const text = el("span", {});
  return { box, text, root: el("label", { class: "inline" }, box, text) };
}

function createItemScale({ color }) {
  const swatch = (number) => {
    const size = 2 * DOT_SIZES[number];
    const style = `width: ${size}px; height: ${size}px; background: ${formatColor(color)}`;
    return { class: "density-dot", style };
  };
  return createScale(ITEM_CLASSES, swatch);
}

/** Return a swatch with the range of counts for each class. */
function createScale(classes, swatch) {
  const entries = classes.map((lowest, number) => {
    const range = formatRange(lowest, classes[number + 1]);
    return el("span", { class: "entry" }, el("i", swatch(number)), range);
  });
  return el("span", { class: "entries" }, entries);
}

/** Return the counts from `lowest` up to, but not including, `next`, such as 2–4 or 50+. */
function formatRange(lowest, next) {
  if (next === undefined) return `${lowest}+`;
  return next - lowest > 1 ? `${lowest}–${next - 1}` : String(lowest);
}
