/** The map of the settings of a live run. The pointer moves, draws and removes its shapes. */

import { el, isServerless } from "../core/common.js";
import { Hint } from "../core/hints.js";
import { WorldView } from "../world/world_view.js";

// Edges of shapes are on this grid. A thinner wall could be stepped over.
const GRID = 10;
const MIN_SIDE = 20;
const NEW_FOOD = { count: 50, energy: 1 };
const TOOLS = {
  move: "Move",
  food: "Add food",
  wall: "Add wall",
  remove: "Remove",
};
const COLORS = { food: "meal", wall: "edge", start: "agent" };

/**
 * @typedef {object} Shape a shape of the map
 * @property {"food"|"wall"|"start"} kind
 * @property {number} index
 * @property {number[]} edges left, right, upper and lower edge
 */

export class LiveMap {
  /**
   * @param {() => any} readExperiment
   * @param {(change: (experiment: any) => void) => void} edit changes the form
   */
  constructor(readExperiment, edit) {
    this.readExperiment = readExperiment;
    this.edit = edit;
    // {shape, from}: the dragged shape, or null for a new one, and the start of the drag.
    this.drag = null;
    this.canvas = el("canvas", {
      class: "live-preview",
      role: "img",
      "aria-label": "Map with the start area and the items",
    });
    this.tools = el(
      "fieldset",
      { class: "compare-ticks", "data-testid": "map-tools" },
      el("legend", { class: "visually-hidden" }, "Drag on the map to"),
      ...Object.entries(TOOLS).map(([tool, title]) =>
        el(
          "label",
          { class: "inline" },
          el("input", { type: "radio", name: "map-tool", value: tool, checked: tool === "move" }),
          title,
        )
      ),
    );
    this.element = el("div", { class: "live-map", hidden: true }, this.canvas);
    // The engine of an exported page has the parts of its own experiments only.
    if (isServerless()) return;
    this.hint = new Hint("map", () => this.tools.querySelector("input:checked"));
    this.element.append(this.tools, this.hint.element);
    this.bindPointer();
  }

  get tool() {
    return /** @type {HTMLInputElement} */ (this.tools.querySelector("input:checked")).value;
  }

  /** Draw the map of valid settings. Models without a map hide it. */
  show(preview) {
    this.element.hidden = !preview.world;
    if (!preview.world) return;
    this.preview = preview;
    this.view = new WorldView(this.canvas);
    this.draw();
  }

  /** Draw the map, with a shape that is not part of the settings yet. */
  draw(kind = null, edges = []) {
    this.view.setWorld(this.preview);
    const [left, right, upper, lower] = edges;
    const box = { x: left, y: upper, width: right - left, height: lower - upper };
    const sketch = { kind: kind === "start" ? "disc" : "rectangle", color: COLORS[kind], ...box };
    const { marks } = this.view.world;
    if (kind) this.view.world.marks = [...marks, sketch];
    this.view.draw(null, 0);
  }

  bindPointer() {
    const { canvas } = this;
    canvas.addEventListener("pointerdown", (event) => {
      const from = this.locate(event);
      const isNew = this.tool in COLORS;
      const shape = isNew ? null : findShape(this.readExperiment(), from);
      if (this.tool === "remove" && shape) return this.edit((tree) => removeShape(tree, shape));
      if (!isNew && !shape) return;
      this.drag = { shape, from };
      canvas.setPointerCapture(event.pointerId);
    });
    canvas.addEventListener("pointermove", (event) => {
      if (this.drag) this.draw(...this.readDrag(event));
    });
    canvas.addEventListener("pointerup", (event) => {
      if (this.drag) this.place(event);
    });
    canvas.addEventListener("pointercancel", () => {
      this.drag = null;
      this.draw();
    });
    // A finger that moves no shape scrolls the page.
    canvas.addEventListener("touchmove", (event) => this.drag && event.preventDefault(), {
      passive: false,
    });
  }

  /** Return the position of the pointer in units of length. */
  locate({ offsetX, offsetY }) {
    return this.view.convertToMap(offsetX, offsetY);
  }

  /** Return the kind and the edges of the dragged shape. */
  readDrag(event) {
    const { shape, from } = this.drag;
    const to = this.locate(event);
    const { width, height } = this.preview.world;
    if (!shape) {
      const edges = [...span(from[0], to[0], width), ...span(from[1], to[1], height)];
      return /** @type {const} */ ([this.tool, edges]);
    }
    const [left, right, upper, lower] = shape.edges;
    const x = shift(left, right, to[0] - from[0], width);
    const y = shift(upper, lower, to[1] - from[1], height);
    return /** @type {const} */ ([shape.kind, [left + x, right + x, upper + y, lower + y]]);
  }

  /** Write the dragged shape into the settings. */
  place(event) {
    const [kind, edges] = this.readDrag(event);
    const { shape } = this.drag;
    this.drag = null;
    this.hint.dismiss();
    this.draw();
    this.edit((experiment) => writeShape(experiment, { kind, index: shape?.index, edges }));
  }
}

/** Return the edges on the grid between two coordinates, on a map of this size. */
function span(from, to, size) {
  const round = (value) => Math.min(size, Math.max(0, Math.round(value / GRID) * GRID));
  const low = Math.min(round(Math.min(from, to)), size - MIN_SIDE);
  return [low, Math.max(round(Math.max(from, to)), low + MIN_SIDE)];
}

/** Return a distance on the grid that keeps the edges `low` and `high` on a map of this size. */
function shift(low, high, distance, size) {
  const rounded = Math.round(distance / GRID) * GRID;
  return Math.min(size - high, Math.max(-low, rounded));
}

/** @returns {Shape[]} the shapes of an experiment, the last drawn one first */
export function listShapes({ world }) {
  const { x, y, radius } = world.start;
  const boxes = world.features?.includes("walls") ? world.walls?.boxes ?? [] : [];
  return [
    { kind: "start", index: 0, edges: [x - radius, x + radius, y - radius, y + radius] },
    ...boxes.map((edges, index) => ({ kind: "wall", index, edges })),
    ...world.food.map((food, index) => ({ kind: "food", index, edges: [...food.x, ...food.y] })),
  ];
}

function findShape(experiment, /** @type {number[]} */ [x, y]) {
  return listShapes(experiment).find(
    ({ edges: [left, right, upper, lower] }) => x >= left && x <= right && y >= upper && y <= lower,
  );
}

/** Move a shape of an experiment, or add one if it has no index. */
export function writeShape({ world }, { kind, index, edges }) {
  const [left, right, upper, lower] = edges;
  if (kind === "start") {
    Object.assign(world.start, { x: (left + right) / 2, y: (upper + lower) / 2 });
  } else if (kind === "food") {
    const food = { ...(world.food[index ?? world.food.length - 1] ?? NEW_FOOD) };
    world.food[index ?? world.food.length] = { ...food, x: [left, right], y: [upper, lower] };
  } else if (world.features.includes("walls")) {
    world.walls.boxes[index ?? world.walls.boxes.length] = edges;
  } else {
    world.features.push("walls");
    world.walls = { boxes: [edges] };
  }
}

/** Remove a food region or a wall. The start stays. */
export function removeShape({ world }, { kind, index }) {
  if (kind === "food") world.food.splice(index, 1);
  if (kind !== "wall") return;
  world.walls.boxes.splice(index, 1);
  if (world.walls.boxes.length) return;
  world.features = world.features.filter((name) => name !== "walls");
  delete world.walls;
}
