/** The keyboard shortcuts of the World tab, and their descriptions. */

import { el } from "../core/common.js";
import { handleKey, listTimeActions } from "./time_bar.js";

const KEYS = {
  space: "play or pause",
  "← →": "one step back or forward (with Shift: 100)",
  "Home End": "first or last step",
  "p n": "previous or next meal (of the open agent, or of any agent)",
  "+ −": "faster or slower",
  "[ ]": "previous or next generation",
  g: "play the generations one after another",
  0: "show the whole map",
  c: "compare two lifetimes",
  a: "list of all agents",
  Esc: "close the inspector",
  "map: + −": "if the map has the focus: zoom in or out",
  "map: arrows": "if an enlarged map has the focus: move it (with Shift: 100 steps of time)",
};

/**
 * Handle a key.
 * @param {KeyboardEvent} event
 * @param {import("./world_tab.js").WorldTab} view
 */
export function handleWorldKey(event, view) {
  // The keys of a dialog do not control the world.
  if (document.querySelector("dialog[open]") || !view.panels.length) return;
  const { player } = view;
  handleKey(event, view.bar.timeline.slider, {
    ...listTimeActions(event, player, 100),
    Home: () => player.seek(0),
    End: () => player.seek(player.last),
    n: () => view.goToMeal(1),
    p: () => view.goToMeal(-1),
    "+": () => player.changeSpeed(1),
    "=": () => player.changeSpeed(1),
    "-": () => player.changeSpeed(-1),
    "[": () => view.changeGeneration(-1),
    "]": () => view.changeGeneration(1),
    g: () => view.generationPlayer.toggle(),
    0: () => view.fit(),
    c: () => view.toggleComparison(),
    a: () => view.set({ listing: !view.listing }),
    Escape: () => view.selectAgent(view.selectedMap, null),
  });
}

/**
 * Handle a key on the tab of models without a world.
 * @param {KeyboardEvent} event
 * @param {import("./model_tab.js").ModelTab} view
 */
export function handleGenerationKey(event, view) {
  const { bar } = view.panel.display.drawer ?? {};
  handleKey(event, bar?.timeline.slider, {
    ...(bar && listTimeActions(event, bar.player, 10)),
    "[": () => view.panel.move(-1),
    "]": () => view.panel.move(1),
    g: () => view.generationPlayer.toggle(),
  });
}

/** Return the dialog that lists the shortcuts. */
export function createKeyboardDialog() {
  const lines = Object.entries(KEYS).map(([key, description]) =>
    el("tr", {}, el("th", { scope: "row" }, el("code", {}, key)), el("td", {}, description))
  );
  return el(
    "dialog",
    { "aria-label": "Keyboard shortcuts" },
    el("h2", {}, "Keyboard shortcuts"),
    el("table", {}, lines),
    el(
      "p",
      { class: "soft" },
      "Zoom with the mouse wheel (with Ctrl if the page scrolls) or with two fingers. " +
        "Drag to move the map. Click or tap an agent to inspect it.",
    ),
    el("form", { method: "dialog" }, el("button", { class: "primary" }, "Close")),
  );
}
