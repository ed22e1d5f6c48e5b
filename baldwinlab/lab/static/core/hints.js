/** Hints at the place of an action. A hint disappears with its button, or with its action. */

import { CLOSE_ICON, createIconButton, el } from "./common.js";

const HINTS = {
  agent: "Select an agent to see what it senses and learns.",
  map: "Drag food, walls or the start.",
  curve: "Select a curve to watch that generation.",
};

export class Hint {
  /**
   * @param {keyof typeof HINTS} name
   * @param {() => HTMLElement|null} findTarget returns the place of the action, which gets the
   *   focus after the button is pressed
   */
  constructor(name, findTarget) {
    this.key = `baldwinlab-hint-${name}`;
    const close = () => {
      this.dismiss();
      findTarget()?.focus();
    };
    this.element = el(
      "p",
      { class: "hint-line", hidden: localStorage.getItem(this.key), "data-testid": `hint-${name}` },
      HINTS[name],
      createIconButton("Dismiss this hint", CLOSE_ICON, close),
    );
  }

  /** Hide the hint, also on later visits. */
  dismiss() {
    if (this.element.hidden) return;
    localStorage.setItem(this.key, "used");
    this.element.hidden = true;
  }
}
