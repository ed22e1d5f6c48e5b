/** The bar below the worlds of the World tab: time, display options and help. */

import { createButton, createIcon, createIconButton, createSelect, el } from "../core/common.js";
import { createKeyboardDialog } from "./shortcuts.js";
import { Legend } from "./legend.js";

const ICONS = {
  mealBefore: "M8 5l-5 5 5 5M12 10a2.2 2.2 0 1 0 4.4 0a2.2 2.2 0 1 0-4.4 0",
  mealAfter: "M12 5l5 5-5 5M3.6 10a2.2 2.2 0 1 0 4.4 0a2.2 2.2 0 1 0-4.4 0",
  fit: "M3 7V3h4M13 3h4v4M17 13v4h-4M7 17H3v-4",
  compare: "M3 4h6v12H3zM11 4h6v12h-6z",
  keys: "M2 6h16v9H2zM5 9h.01M8 9h.01M11 9h.01M14 9h.01M6 12h8",
  behavior: "M4 3v13h13M8 12h.01M11 9h.01M14 5h.01M9 6h.01",
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

  createOptions({ fit, showBehavior }) {
    return el(
      "div",
      { class: "row options" },
      this.trails,
      el("label", { class: "inline recorded" }, this.sight, "sight"),
      this.compare,
      this.agents,
      createBarButton("behavior", "Map of behavior: innate and learned", showBehavior),
      createBarButton("fit", "Show the whole map (0)", fit),
      createBarButton("keys", "Keyboard shortcuts", () => this.help.showModal()),
    );
  }

  showOptions({ trails, sight, isComparing, listing }) {
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
