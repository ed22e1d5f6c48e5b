/** Numbers in sentences that the reader changes: by dragging, with a slider, or with the keyboard. */

// A drag begins after this number of pixels, if it is more horizontal than vertical.
const MIN_DRAG = 4;

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
      bindDrag(input.parentElement, input);
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

  /** Return the names and the shown numbers of all dials. */
  list() {
    return [...this.inputs].map(([name, { value }]) => [name, this.format(name, Number(value))]);
  }

  /** Return whether all dials have the value of the opened page. */
  get areUnchanged() {
    return [...this.inputs.values()].every(({ value, defaultValue }) => value === defaultValue);
  }

  /** Call a function after each change. */
  listen(changed) {
    for (const input of this.inputs.values()) input.addEventListener("input", changed);
  }

  disable() {
    for (const input of this.inputs.values()) input.disabled = true;
  }
}

/**
 * Change an input by dragging its dial, the number or the slider, to the left or the right.
 *
 * The slider has no pointer events of its own, because it would jump to a finger that scrolls the
 * page. A vertical swipe scrolls, and the browser then cancels the pointer.
 */
function bindDrag(dial, input) {
  let start = null;
  dial.addEventListener("pointerdown", (event) => {
    if (input.disabled || event.button) return;
    start = { x: event.clientX, y: event.clientY, value: Number(input.value), isDrag: false };
    dial.setPointerCapture(event.pointerId);
  });
  dial.addEventListener("pointermove", ({ clientX, clientY }) => {
    if (!start) return;
    const [x, y] = [clientX - start.x, clientY - start.y];
    start.isDrag ||= Math.abs(x) >= MIN_DRAG && Math.abs(x) > Math.abs(y);
    if (start.isDrag) change(input, start.value + (x / input.clientWidth) * readSpan(input));
  });
  dial.addEventListener("pointerup", ({ clientX, clientY }) => {
    const isPress = start && !start.isDrag && Math.abs(clientY - start.y) < MIN_DRAG;
    start = null;
    if (!isPress) return;
    input.focus();
    const { left, width } = input.getBoundingClientRect();
    const share = (clientX - left) / width;
    if (share >= 0) change(input, Number(input.min) + share * readSpan(input));
  });
  dial.addEventListener("pointercancel", () => (start = null));
  // Without this, the browser cancels the pointer of a horizontal drag after a few pixels.
  dial.addEventListener("touchmove", (event) => start?.isDrag && event.preventDefault(), {
    passive: false,
  });
}

function readSpan(input) {
  return input.max - input.min;
}

/** Set a value. The browser rounds it to a possible one. */
function change(input, value) {
  const before = input.value;
  input.value = String(value);
  if (input.value !== before) input.dispatchEvent(new Event("input"));
}
