/** The bar below the worlds of the World tab: time, options, help and keyboard shortcuts. */

import { createButton, createIcon, createIconButton, createSelect, el } from "../core/common.js";
import { Legend } from "./legend.js";
import { handleKey, listTimeActions } from "./time_bar.js";

const ICONS = {
  mealBefore: "M8 5l-5 5 5 5M12 10a2.2 2.2 0 1 0 4.4 0a2.2 2.2 0 1 0-4.4 0",
  mealAfter: "M12 5l5 5-5 5M3.6 10a2.2 2.2 0 1 0 4.4 0a2.2 2.2 0 1 0-4.4 0",
  fit: "M3 7V3h4M13 3h4v4M17 13v4h-4M7 17H3v-4",
  compare: "M3 4h6v12H3zM11 4h6v12h-6z",
  keys: "M2 6h16v9H2zM5 9h.01M8 9h.01M11 9h.01M14 9h.01M6 12h8",
  agents: "M7 5h10M7 10h10M7 15h10M3 5h.01M3 10h.01M3 15h.01",
};
const TRAILS = { off: "no trails", recent: "recent trails", life: "full trails" };

export class WorldControls {
  /**
   * @param {import("./time_bar.js").TimeBar} bar
   * @param {{set: (change: {trails?: string, sight?: boolean, listing?: boolean}) => void,
   *   toggleComparison: () => void, fit: () => void, goToMeal: (direction: number) => void,
   *   showBehavior: () => void}}
   *   callbacks
   */
  constructor(bar, callbacks) {
    this.trails = createSelect(Object.entries(TRAILS), "", (trails) => callbacks.set({ trails }), {
      class: "recorded",
      "aria-label": "Trails",
      "data-testid": "trails",
    });
    const toggleSight = () => callbacks.set({ sight: this.sight.checked });
    this.sight = el("input", { type: "checkbox", "data-testid": "sight", onchange: toggleSight });
    this.compare = createButton(
      [createIcon(ICONS.compare), el("span", { class: "wide" }, "Compare")],
      callbacks.toggleComparison,
      { "data-testid": "compare", title: "Compare two lifetimes step by step (c)" },
    );
    const toggleList = () =>
      callbacks.set({ listing: this.agents.getAttribute("aria-pressed") !== "true" });
    this.agents = createBarButton("agents", "All agents (a)", toggleList, "quiet square lister");
    this.behavior = createButton("Is it innate?", callbacks.showBehavior, {
      title: "Fitness without and with learning, by generation",
      "data-testid": "behavior",
    });
    this.legend = new Legend();
    this.help = createKeyboardDialog();
    this.root = el(
      "div",
      { class: "transport" },
      bar.timeline.root,
      el(
        "div",
        { class: "controls" },
        createTimeRow(bar, callbacks),
        this.legend.root,
        this.createOptions(callbacks),
      ),
      this.help,
    );
  }

  createOptions({ fit }) {
    return el(
      "div",
      { class: "row options" },
      this.trails,
      el("label", { class: "inline recorded" }, this.sight, "sight"),
      this.compare,
      this.agents,
      this.behavior,
      createBarButton("fit", "Show the whole map (0)", fit),
      createBarButton("keys", "Keyboard shortcuts", () => this.help.showModal()),
    );
  }

  showOptions({ trails, sight, isComparing, listing, isStored }) {
    this.behavior.hidden = !isStored;
    this.trails.value = trails;
    this.agents.setAttribute("aria-pressed", listing);
    this.sight.checked = sight;
    this.compare.setAttribute("aria-pressed", isComparing);
  }
}

function createTimeRow({ back, play, forward, speed, clock }, { goToMeal }) {
  return el(
    "div",
    { class: "row time" },
    createBarButton("mealBefore", "Previous meal (p)", () => goToMeal(-1)),
    back,
    play,
    forward,
    createBarButton("mealAfter", "Next meal (n)", () => goToMeal(1)),
    speed,
    clock,
  );
}

function createBarButton(name, label, action, kind = "quiet square") {
  return createIconButton(label, ICONS[name], action, { class: kind, "data-testid": name });
}

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

/** Return the dialog that lists the shortcuts. */
function createKeyboardDialog() {
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
