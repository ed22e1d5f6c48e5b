/** The legend of a density, with switches that hide agents or items. */

import { el } from "../core/common.js";
import {
  AGENT_CLASSES,
  DOT_SIZES,
  ITEM_CLASSES,
  nameAgentColor,
  SQUARE_SIZE,
} from "./density_layer.js";
import { formatColor } from "../core/palette.js";

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
   * @param {import("./frame.js").Frame|null} frame
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
