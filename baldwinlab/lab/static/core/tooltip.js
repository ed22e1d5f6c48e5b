/** A tooltip next to the pointer. The page also shows this information as text. */

import { el } from "./common.js";

export class Tooltip {
  /** @param {HTMLElement} root contains the tooltip */
  constructor(root) {
    this.root = root;
    this.element = el("div", { class: "tip number", "aria-hidden": "true", hidden: true });
    root.append(this.element);
  }

  /**
   * @param {string|null} text null hides the tooltip
   * @param {number} [x] CSS pixels from the left of `root`
   * @param {number} [y] CSS pixels from its top
   */
  show(text, x = 0, y = 0) {
    this.element.hidden = text === null;
    if (text === null) return;
    this.element.textContent = text;
    const maxLeft = this.root.clientWidth - this.element.offsetWidth - 4;
    this.element.style.left = `${Math.max(4, Math.min(x + 12, maxLeft))}px`;
    this.element.style.top = `${y - 30}px`;
  }
}
