/** SVG drawings: elements, ranges, axis ticks, and elements that can be pressed. */

const SVG = "http://www.w3.org/2000/svg";

export function createSvg(tag, attributes, ...children) {
  const element = document.createElementNS(SVG, tag);
  for (const [name, value] of Object.entries(attributes)) element.setAttribute(name, value);
  element.append(...children);
  return element;
}

/** Return a line across the plot that is visible on light and dark backgrounds. */
export function drawGridLine(x1, y1, x2, y2) {
  return createSvg("line", { x1, y1, x2, y2, stroke: "currentColor", "stroke-opacity": 0.18 });
}

/** Return a text label next to a plot. `anchor` is start, middle or end. */
export function drawTextLabel(text, x, y, anchor = "start", attributes = {}) {
  const style = { fill: "currentColor", "font-size": 12, opacity: 0.85 };
  return createSvg("text", { x, y, "text-anchor": anchor, ...style, ...attributes }, text);
}

/** Return a horizontal grid line, and the text at its left end. */
export function drawGridRow(text, left, right, y) {
  return [drawGridLine(left, y, right, y), drawTextLabel(text, left - 8, y + 4, "end")];
}

/**
 * Return the range from the lowest to the highest number of some lists, with 0. Missing numbers,
 * which are null or NaN, are ignored. Without another number, the range is 0 to 1.
 * @param {Iterable<number|null>[]} lists
 */
export function computeRange(...lists) {
  // Math.min(...values) fails for very many values.
  let [low, high] = [0, 0];
  for (const values of lists) {
    for (const value of values) {
      if (!Number.isFinite(value)) continue;
      low = Math.min(low, value);
      high = Math.max(high, value);
    }
  }
  return low === high ? [0, 1] : [low, high];
}

/**
 * Return about five ticks in steps of 1, 2 or 5 x 10^n, which include 0. The first tick is at or
 * below `low`, and the last one at or above `high`.
 */
export function chooseTicks(low, high) {
  const step = chooseStep(high - low);
  return listMultiples(step, Math.floor(low / step + 1e-9), Math.ceil(high / step - 1e-9));
}

function chooseStep(span) {
  const rough = span / 5;
  const power = 10 ** Math.floor(Math.log10(rough));
  return power * [1, 2, 5, 10].find((factor) => factor * power >= rough);
}

function listMultiples(step, first, last) {
  return Array.from(
    { length: Math.max(0, last - first + 1) },
    (_, number) => Number(((first + number) * step).toPrecision(12)),
  );
}

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
