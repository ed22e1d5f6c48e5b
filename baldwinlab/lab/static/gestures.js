/** Pointer gestures on a map: wheel and pinch zoom, dragging moves, a click or tap selects. */

// CSS pixels that the pointer may move during a click.
const CLICK_TOLERANCE = 5;

/** Return whether the wheel scrolls the page, which has priority over zooming. */
function isScrollable(page) {
  return page !== null && page.scrollHeight > page.clientHeight + 1;
}

/**
 * @param {HTMLCanvasElement} canvas
 * @param {import("./world.js").WorldView} view
 * @param {{changed: () => void, picked: (agent: number|null) => void, fitted: () => void, hovered?:
 *   (agent: number|null, x: number, y: number) => void}} callbacks
 */
export function bindGestures(canvas, view, { changed, picked, fitted, hovered }) {
  const pointers = new Map();
  let moved = 0;
  const position = (event) => [event.offsetX, event.offsetY];

  canvas.addEventListener(
    "wheel",
    (event) => {
      if (!event.ctrlKey && isScrollable(canvas.closest("main"))) return;
      event.preventDefault();
      const lines = event.deltaMode === 1 ? 16 : 1;
      view.zoomAt(
        Math.exp(-event.deltaY * lines * (event.ctrlKey ? 0.01 : 0.0016)),
        ...position(event),
      );
      changed();
    },
    { passive: false },
  );

  // Two fingers zoom the map instead of scrolling the page.
  canvas.addEventListener(
    "touchmove",
    (event) => event.touches.length > 1 && event.preventDefault(),
    { passive: false },
  );

  canvas.addEventListener("pointerdown", (event) => {
    if (event.button !== 0) return;
    canvas.setPointerCapture(event.pointerId);
    if (pointers.size === 0) moved = 0;
    pointers.set(event.pointerId, position(event));
  });

  canvas.addEventListener("pointermove", (event) => {
    const old = pointers.get(event.pointerId);
    if (!old) {
      const agent = view.findAgent(...position(event));
      canvas.style.cursor = agent === null ? "grab" : "pointer";
      if (event.pointerType === "mouse") hovered?.(agent, ...position(event));
      return;
    }
    const current = position(event);
    const delta = [current[0] - old[0], current[1] - old[1]];
    moved += Math.hypot(...delta);
    if (pointers.size === 2) pinch(event.pointerId, old, current);
    else if (moved > CLICK_TOLERANCE) view.pan(...delta);
    pointers.set(event.pointerId, current);
    if (moved > CLICK_TOLERANCE) changed();
  });

  /** Zoom around the center between two fingers. */
  function pinch(id, old, current) {
    const [, second] = [...pointers].find(([key]) => key !== id);
    const distanceTo = (from) => Math.max(1, Math.hypot(from[0] - second[0], from[1] - second[1]));
    view.zoomAt(
      distanceTo(current) / distanceTo(old),
      (current[0] + second[0]) / 2,
      (current[1] + second[1]) / 2,
    );
    view.pan((current[0] - old[0]) / 2, (current[1] - old[1]) / 2);
  }

  canvas.addEventListener("pointerup", (event) => {
    if (pointers.delete(event.pointerId) && moved <= CLICK_TOLERANCE)
      picked(view.findAgent(...position(event), event.pointerType === "touch" ? 28 : 16));
  });
  canvas.addEventListener("pointerleave", () => hovered?.(null, 0, 0));
  canvas.addEventListener("pointercancel", (event) => pointers.delete(event.pointerId));
  canvas.addEventListener("dblclick", fitted);
}
