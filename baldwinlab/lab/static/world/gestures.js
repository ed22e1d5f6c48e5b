/** Zoom buttons, gestures and keys of a map: wheel, two fingers, dragging and clicks. */

import { createIconButton } from "../core/common.js";

// CSS pixels that the pointer may move during a click.
const CLICK_TOLERANCE = 5;
// CSS pixels between an agent and a click or a tap that selects it.
const CLICK_REACH = 16;
const TAP_REACH = 28;
// CSS pixels of a line, for wheels that count lines.
const LINE_HEIGHT = 16;
// CSS pixels that an arrow key moves the map.
const PAN_DISTANCE = 60;
const PAN_KEYS = {
  ArrowLeft: [PAN_DISTANCE, 0],
  ArrowRight: [-PAN_DISTANCE, 0],
  ArrowUp: [0, PAN_DISTANCE],
  ArrowDown: [0, -PAN_DISTANCE],
};

/** Return whether the wheel scrolls the page, which has priority over zooming. */
function isScrollable(page) {
  return page !== null && page.scrollHeight > page.clientHeight + 1;
}

function readPosition(event) {
  return [event.offsetX, event.offsetY];
}

/**
 * Handle the gestures on a canvas.
 * @param {HTMLCanvasElement} canvas
 * @param {import("./world_view.js").WorldView} view
 * @param {{changed: () => void, picked: (agent: number|null) => void, fitted: () => void, hovered?:
 *   (agent: number|null, x: number, y: number) => void}} callbacks
 */
export function bindGestures(canvas, view, callbacks) {
  bindWheel(canvas, view, callbacks.changed);
  canvas.addEventListener("keydown", (event) => handleMapKey(event, view, callbacks));
  const tracker = new PointerTracker(canvas, view, callbacks);
  canvas.addEventListener("pointerdown", (event) => tracker.press(event));
  canvas.addEventListener("pointermove", (event) => tracker.move(event));
  canvas.addEventListener("pointerup", (event) => tracker.release(event));
  canvas.addEventListener("pointercancel", (event) => tracker.cancel(event));
  // Two fingers zoom the map instead of scrolling the page.
  canvas.addEventListener(
    "touchmove",
    (event) => event.touches.length > 1 && event.preventDefault(),
    { passive: false },
  );
  canvas.addEventListener("pointerleave", () => callbacks.hovered?.(null, 0, 0));
  canvas.addEventListener("dblclick", callbacks.fitted);
}

function bindWheel(canvas, view, changed) {
  const zoom = (event) => {
    if (!event.ctrlKey && isScrollable(canvas.closest("main"))) return;
    event.preventDefault();
    const unit = event.deltaMode === WheelEvent.DOM_DELTA_LINE ? LINE_HEIGHT : 1;
    // A pinch on a touchpad arrives as small movements with Ctrl.
    const speed = event.ctrlKey ? 0.01 : 0.0016;
    view.zoomAt(Math.exp(-event.deltaY * unit * speed), ...readPosition(event));
    changed();
  };
  canvas.addEventListener("wheel", zoom, { passive: false });
}

/** Handle a key of the focused map. Other keys control the complete view. */
function handleMapKey(event, view, { changed, fitted }) {
  const { key } = event;
  const isZoomed = view.camera.zoom > 1;
  if (event.ctrlKey || event.metaKey || event.altKey) return;
  if (key === "+" || key === "=") view.zoomAt(ZOOM_FACTOR);
  else if (key === "-") view.zoomAt(1 / ZOOM_FACTOR);
  else if (key === "0") return stop(event, fitted);
  else if (isZoomed && !event.shiftKey && key in PAN_KEYS) view.pan(...PAN_KEYS[key]);
  else return;
  stop(event, changed);
}

/** Run an action instead of the action of the page. */
function stop(event, action) {
  event.preventDefault();
  event.stopPropagation();
  action();
}

/** The pressed pointers, and the distance that they have moved. */
class PointerTracker {
  constructor(canvas, view, /** @type {Object<string, Function>} */ callbacks) {
    const { changed, picked, hovered } = callbacks;
    this.canvas = canvas;
    this.view = view;
    this.changed = changed;
    this.picked = picked;
    this.hovered = hovered;
    this.distance = 0;
    // The position of each pressed pointer, by id.
    this.positions = new Map();
  }

  press(event) {
    if (event.button !== 0) return;
    this.canvas.setPointerCapture(event.pointerId);
    if (this.positions.size === 0) this.distance = 0;
    this.positions.set(event.pointerId, readPosition(event));
  }

  move(event) {
    const old = this.positions.get(event.pointerId);
    if (!old) return this.hover(event);
    const current = readPosition(event);
    const delta = [current[0] - old[0], current[1] - old[1]];
    this.distance += Math.hypot(...delta);
    const isDragging = this.distance > CLICK_TOLERANCE;
    if (this.positions.size === 2) this.pinch(event.pointerId, old, current);
    else if (isDragging) this.view.pan(...delta);
    this.positions.set(event.pointerId, current);
    if (isDragging) this.changed();
  }

  hover(event) {
    const agent = this.view.findAgent(...readPosition(event));
    this.canvas.style.cursor = agent === null ? "grab" : "pointer";
    if (event.pointerType === "mouse") this.hovered?.(agent, ...readPosition(event));
  }

  /** Zoom around the center between two fingers. */
  pinch(id, old, current) {
    const { view } = this;
    const [, second] = [...this.positions].find(([key]) => key !== id);
    const distanceTo = (from) => Math.max(1, Math.hypot(from[0] - second[0], from[1] - second[1]));
    view.zoomAt(
      distanceTo(current) / distanceTo(old),
      (current[0] + second[0]) / 2,
      (current[1] + second[1]) / 2,
    );
    view.pan((current[0] - old[0]) / 2, (current[1] - old[1]) / 2);
  }

  release(event) {
    const wasPressed = this.positions.delete(event.pointerId);
    if (!wasPressed || this.distance > CLICK_TOLERANCE) return;
    const reach = event.pointerType === "touch" ? TAP_REACH : CLICK_REACH;
    this.picked(this.view.findAgent(...readPosition(event), reach));
  }

  cancel(event) {
    this.positions.delete(event.pointerId);
  }
}

// Zoom factor of a press.
const ZOOM_FACTOR = 1.5;

/** @type {Object<string, {label: string, path: string, act: (map: any) => void}>} */
const BUTTONS = {
  closer: { label: "Zoom in (+)", path: "M10 4v12M4 10h12", act: (map) => map.zoom(ZOOM_FACTOR) },
  farther: { label: "Zoom out (−)", path: "M4 10h12", act: (map) => map.zoom(1 / ZOOM_FACTOR) },
  all: {
    label: "Show the whole map (0)",
    path: "M3 7V3h4M13 3h4v4M17 13v4h-4M7 17H3v-4",
    act: (map) => map.fit(),
  },
};

/**
 * @param {import("./world_map.js").WorldMap} map
 * @param {("closer"|"farther"|"all")[]} names
 */
export function createZoomButtons(map, names) {
  return names.map((name) => {
    const { label, path, act } = BUTTONS[name];
    return createIconButton(label, path, () => act(map), { "data-testid": `zoom-${name}` });
  });
}
