/** Pointer gestures on a map: wheel and pinch zoom, dragging moves, a click or tap selects. */

// CSS pixels that the pointer may move during a click.
const STILL = 5;

/** Return whether the wheel scrolls the page, which has priority over zooming. */
function scrolls(page) {
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
      if (!event.ctrlKey && scrolls(canvas.closest("main"))) return;
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
      const under = view.agentAt(...position(event));
      canvas.style.cursor = under === null ? "grab" : "pointer";
      if (event.pointerType === "mouse") hovered?.(under, ...position(event));
      return;
    }
    const now = position(event);
    const delta = [now[0] - old[0], now[1] - old[1]];
    moved += Math.hypot(...delta);
    if (pointers.size === 2) pinch(event.pointerId, old, now);
    else if (moved > STILL) view.pan(...delta);
    pointers.set(event.pointerId, now);
    if (moved > STILL) changed();
  });

  /** Zoom around the center between two fingers. */
  function pinch(id, old, now) {
    const [, second] = [...pointers].find(([key]) => key !== id);
    const distanceTo = (from) => Math.max(1, Math.hypot(from[0] - second[0], from[1] - second[1]));
    view.zoomAt(
      distanceTo(now) / distanceTo(old),
      (now[0] + second[0]) / 2,
      (now[1] + second[1]) / 2,
    );
    view.pan((now[0] - old[0]) / 2, (now[1] - old[1]) / 2);
  }

  canvas.addEventListener("pointerup", (event) => {
    if (pointers.delete(event.pointerId) && moved <= STILL)
      picked(view.agentAt(...position(event), event.pointerType === "touch" ? 28 : 16));
  });
  canvas.addEventListener("pointerleave", () => hovered?.(null, 0, 0));
  canvas.addEventListener("pointercancel", (event) => pointers.delete(event.pointerId));
  canvas.addEventListener("dblclick", fitted);
}
