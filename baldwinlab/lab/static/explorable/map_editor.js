/** The editor of a map: rectangles that the pointer draws, or that number fields describe. */

import { createButton, el } from "../core/common.js";
import { formatText } from "./figure.js";
import { createShape, KINDS, MAP_SIZE, MAX_SHAPES } from "./map_settings.js";

// A new rectangle of the keyboard.
const FIRST_SHAPE = [280, 360, 280, 360];
const EDGES = ["left", "right", "top", "bottom"];
const EDGE_STEP = 10;
const COLORS = { food: "green", wall: "text", poison: "poison" };

export class MapEditor {
  /**
   * @param {import("./map_view.js").MapView} map
   * @param {Object<string, string>} strings
   * @param {() => void} changed
   */
  constructor(map, strings, changed) {
    this.map = map;
    this.strings = strings;
    this.changed = changed;
    this.start = null;
    this.tools = KINDS.map((kind, index) =>
      el("input", { type: "radio", name: "map-tool", value: kind, checked: index === 0 })
    );
    const tools = this.tools.map((input) =>
      el("label", { class: `tool ${input.value}` }, input, strings[input.value])
    );
    const addButton = createButton("", () => this.add(FIRST_SHAPE));
    const clearButton = createButton(strings.clear, () => this.clear());
    const showTool =
      () => (addButton.textContent = formatText(strings.add, { tool: strings[this.kind] }));
    for (const input of this.tools) input.addEventListener("change", showTool);
    this.shapes = el("div", { class: "shapes" });
    this.message = el("p", { class: "warning", role: "status" });
    this.root = el(
      "div",
      { class: "editor" },
      el("fieldset", { class: "tools" }, el("legend", {}, strings.tool), ...tools),
      el("div", { class: "row" }, addButton, clearButton),
      el("details", {}, el("summary", {}, strings.shapes), this.shapes),
      this.message,
    );
    showTool();
    this.bindPointer(map.canvas);
  }

  /** @param {import("./map_settings.js").MapSettings} settings are changed */
  edit(settings) {
    this.settings = settings;
    this.listShapes();
  }

  get kind() {
    return this.tools.find((input) => input.checked).value;
  }

  bindPointer(canvas) {
    const locate = ({ offsetX, offsetY }) => this.map.view.convertToMap(offsetX, offsetY);
    canvas.style.touchAction = "none";
    canvas.addEventListener("pointerdown", (event) => {
      this.start = locate(event);
      canvas.setPointerCapture(event.pointerId);
    });
    canvas.addEventListener("pointermove", (event) => {
      if (this.start)
        this.map.showSketch(COLORS[this.kind], createShape(this.start, locate(event)));
    });
    canvas.addEventListener("pointerup", (event) => {
      if (this.start) this.add(createShape(this.start, locate(event)));
      this.start = null;
    });
    canvas.addEventListener("pointercancel", () => {
      this.start = null;
      this.changed();
    });
  }

  add(shape) {
    const shapes = this.settings[this.kind];
    const isFull = shapes.length >= MAX_SHAPES;
    this.message.textContent = isFull ? formatText(this.strings.full, { number: MAX_SHAPES }) : "";
    if (!isFull) shapes.push([...shape]);
    this.update();
  }

  clear() {
    for (const kind of KINDS) this.settings[kind] = [];
    this.update();
  }

  update() {
    this.listShapes();
    this.changed();
  }

  /** Show number fields for the edges of each shape. */
  listShapes() {
    const rows = KINDS.flatMap((kind) =>
      this.settings[kind].map((shape, index) => this.createRow(kind, shape, index))
    );
    this.shapes.replaceChildren(...rows);
  }

  createRow(kind, shape, index) {
    const { strings } = this;
    const names = { tool: strings[kind], number: index + 1 };
    const fields = EDGES.map((edge, position) =>
      el(
        "label",
        {},
        strings[edge],
        el("input", {
          type: "number",
          min: 0,
          max: MAP_SIZE,
          step: EDGE_STEP,
          value: shape[position],
          onchange: ({ target }) => this.moveEdge(kind, index, position, target),
        }),
      )
    );
    const remove = () => {
      this.settings[kind].splice(index, 1);
      this.update();
    };
    return el(
      "fieldset",
      {},
      el("legend", {}, formatText(strings.shape, names)),
      ...fields,
      createButton(formatText(strings.remove, names), remove),
    );
  }

  moveEdge(kind, index, position, input) {
    const shape = [...this.settings[kind][index]];
    shape[position] = Number(input.value);
    const [left, right, upper, lower] = shape;
    const moved = createShape([left, upper], [right, lower]);
    this.settings[kind][index] = moved;
    input.value = String(moved[position]);
    this.changed();
  }
}
