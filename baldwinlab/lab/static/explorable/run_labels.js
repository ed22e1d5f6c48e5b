/** Labels of the earlier runs of a chart, at the ends of their pale lines. */

// Settings in a label, one per line.
const MAX_LINES = 2;
// Distances of a label from the end of its curve, in lines of text. The first free one is used.
const SHIFTS = [0, 0.5, -0.5, 1, -1, 1.5, -1.5, 2, -2, 2.5, -2.5, 3, -3];

/**
 * @typedef {object} RunSettings
 * @property {[any, string][]} settings values with their texts, in the same order for all runs
 * @property {string} name tells runs with equal settings apart; "" if they have equal curves
 */

/**
 * Return the texts of the settings in which an earlier run differs from the current one.
 * @param {RunSettings} run
 * @param {RunSettings} current
 */
export function describeDifferences(run, current) {
  const texts = run.settings
    .filter(([value], index) => value !== current.settings[index][0])
    .map(([, text]) => text);
  if (!texts.length && run.name) return [run.name];
  const hidden = texts.splice(MAX_LINES);
  return hidden.length ? [...texts.slice(0, -1), `${texts.at(-1)} …`] : texts;
}

/**
 * Return the boxes that find a free place, moved up or down to it. The first boxes choose first.
 * @template {{left: number, right: number, top: number, bottom: number}} Box
 * @param {Box[]} boxes
 * @param {{left: number, right: number, top: number, bottom: number}[]} obstacles
 * @param {{top: number, bottom: number}} limits
 * @param {number} lineHeight
 */
export function placeBoxes(boxes, obstacles, limits, lineHeight) {
  const placed = [...obstacles];
  return boxes.flatMap((box) => {
    const choices = SHIFTS.map((lines) => ({
      ...box,
      top: box.top + lines * lineHeight,
      bottom: box.bottom + lines * lineHeight,
    }));
    const free = choices.find((choice) =>
      choice.top >= limits.top && choice.bottom <= limits.bottom &&
      !placed.some((other) => doOverlap(choice, other))
    );
    if (free) placed.push(free);
    return free ?? [];
  });
}

function doOverlap(first, second) {
  return first.left < second.right && second.left < first.right &&
    first.top < second.bottom && second.top < first.bottom;
}
