/** Elements of a drawing that can be pressed, with one stop of the Tab key for all of them. */

/**
 * Make elements buttons. The arrow keys move between them.
 * @param {Element[]} elements
 * @param {string[]} labels for screen readers
 * @param {(index: number) => void} pick
 */
export function bindButtons(elements, labels, pick) {
  elements.forEach((element, index) => {
    element.setAttribute("role", "button");
    element.setAttribute("tabindex", index ? "-1" : "0");
    element.setAttribute("aria-label", labels[index]);
    element.addEventListener("click", () => pick(index));
    element.addEventListener(
      "keydown",
      (/** @type {KeyboardEvent} */ event) => handleKey(event, elements, index, pick),
    );
  });
}

function handleKey(event, elements, index, pick) {
  const offset = { ArrowRight: 1, ArrowDown: 1, ArrowLeft: -1, ArrowUp: -1 }[event.key];
  if (event.key === "Enter" || event.key === " ") pick(index);
  else if (!offset) return;
  else {
    const next = elements[(index + offset + elements.length) % elements.length];
    elements[index].setAttribute("tabindex", "-1");
    next.setAttribute("tabindex", "0");
    next.focus();
  }
  event.preventDefault();
}
