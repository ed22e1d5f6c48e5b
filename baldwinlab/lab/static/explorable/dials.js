/** The numbers in the sentences of a step that the reader can drag. */

export class Dials {
  /**
   * @param {HTMLElement} section
   * @param {(name: string, value: number) => string} format shows a number
   */
  constructor(section, format) {
    /** @type {Map<string, HTMLInputElement>} */
    this.inputs = new Map();
    this.format = format;
    const inputs = /** @type {NodeListOf<HTMLInputElement>} */ (
      section.querySelectorAll("[data-dial]")
    );
    for (const input of inputs) {
      this.inputs.set(input.dataset.dial, input);
      input.addEventListener("input", () => this.show(input));
      this.show(input);
    }
  }

  show(input) {
    const text = this.format(input.dataset.dial, Number(input.value));
    input.previousElementSibling.textContent = text;
    input.setAttribute("aria-valuetext", text);
  }

  read(name) {
    return Number(this.inputs.get(name).value);
  }

  /** Call a function after each change. */
  listen(changed) {
    for (const input of this.inputs.values()) input.addEventListener("input", changed);
  }

  disable() {
    for (const input of this.inputs.values()) input.disabled = true;
  }
}
