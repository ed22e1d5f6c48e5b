/** Folded parts of the Results tab, which are drawn when they are opened. */

import { el } from "../core/common.js";

/** A part with a heading. Its charts are drawn at the first opening, when they have a width. */
export class Fold {
  /**
   * @param {string} id
   * @param {string} title
   * @param {boolean} isOpen at first
   * @param {(root: HTMLElement) => {destroy: () => void}[]} draw fills an element, and returns its
   *   charts
   */
  constructor(id, title, isOpen, draw) {
    this.draw = draw;
    this.charts = null;
    this.content = el("div");
    this.element = el(
      "details",
      { class: "card", open: isOpen, "data-testid": id, ontoggle: () => this.drawOnce() },
      el("summary", {}, el("h2", {}, title)),
      this.content,
    );
  }

  drawOnce() {
    if (this.element.open) this.charts ??= this.draw(this.content);
  }

  destroy() {
    for (const chart of this.charts ?? []) chart.destroy();
  }
}
