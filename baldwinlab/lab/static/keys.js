/** The keys of the World tab, and the words about them. */

import { el } from "./common.js";

const KEYS = {
  space: "play or pause",
  "← →": "a step back or on; with shift: 100",
  "Home End": "first or last step",
  "p n": "the meal before or after this step, of the open agent or of any",
  "+ −": "faster or slower",
  "[ ]": "generation before or after",
  g: "the life of one generation after the other",
  0: "the whole map",
  c: "side by side",
  a: "the list of all agents",
  Esc: "close the inspector",
};

/** Does what a key means. @param {KeyboardEvent} event @param {import("./view_world.js").WorldTab} view */
export function steer(event, view) {
  if (view.transport?.help.open || !view.panels.length) return;
  const { player } = view;
  act(event, view.timeline.slider, {
    " ": () => player.toggle(),
    ArrowLeft: () => player.step(event.shiftKey ? -100 : -1),
    ArrowRight: () => player.step(event.shiftKey ? 100 : 1),
    Home: () => player.seek(0),
    End: () => player.seek(player.last),
    n: () => view.toMeal(1),
    p: () => view.toMeal(-1),
    "+": () => player.shift(1),
    "=": () => player.shift(1),
    "-": () => player.shift(-1),
    "[": () => view.goOn(-1),
    "]": () => view.goOn(1),
    g: () => view.tour.toggle(),
    0: () => view.fit(),
    c: () => view.toggleBeside(),
    a: () => view.set({ listing: !view.listing }),
    Escape: () => view.pick(view.side, null),
  });
}

/** The same where lives have no world; time goes where what is shown has a time. @param {KeyboardEvent} event @param {import("./view_looks.js").LooksTab} view */
export function steerGenerations(event, view) {
  const { player } = view.panel.drawer ?? {};
  const time = player && {
    " ": () => player.toggle(),
    ArrowLeft: () => player.step(event.shiftKey ? -10 : -1),
    ArrowRight: () => player.step(event.shiftKey ? 10 : 1),
  };
  act(event, null, {
    ...time,
    "[": () => view.goOn(-1),
    "]": () => view.goOn(1),
    g: () => view.tour.toggle(),
  });
}

/** @param {HTMLElement|null} own the slider whose keys are those of the whole view @param {Object<string, () => void>} acts by key */
function act(event, own, acts) {
  if (
    event.ctrlKey ||
    event.metaKey ||
    event.altKey ||
    !Object.hasOwn(acts, event.key) ||
    hasKeys(event, own)
  )
    return;
  event.preventDefault();
  acts[event.key]();
}

/** Whether what has the focus has this key for itself. */
function hasKeys({ target, key }, own) {
  if (target.matches?.("select, textarea, input:not([type=range], [type=checkbox])")) return true;
  if (target.matches?.("button, a, input[type=checkbox]")) return key === " ";
  return (
    target.matches?.("input[type=range]") && target !== own && /^(Arrow|Home|End|Page)/.test(key)
  );
}

/** The dialog that lists them. */
export function help() {
  const lines = Object.entries(KEYS).map(([key, what]) =>
    el("tr", {}, el("th", { scope: "row" }, el("code", {}, key)), el("td", {}, what)),
  );
  return el(
    "dialog",
    { "aria-label": "Keys" },
    el("h2", {}, "Keys"),
    el("table", {}, lines),
    el(
      "p",
      { class: "soft" },
      "The wheel, with Ctrl where the page scrolls, or a pinch zooms; dragging moves; a click or tap on an agent opens it.",
    ),
    el("form", { method: "dialog" }, el("button", { class: "primary" }, "Close")),
  );
}
