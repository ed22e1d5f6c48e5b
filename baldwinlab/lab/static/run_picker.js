/** The controls of what is shown of a live run: the list of runs, and the newest generation. */

import { createButton, createSelect, el } from "./common.js";

/**
 * Return the list of runs, or null for a single run.
 * @param {(run: number) => void} picked
 */
export function createRunPicker(runs, run, picked) {
  if (runs === 1) return null;
  const options = Array.from({ length: runs }, (_, number) => [number, `run ${number}`]);
  const attributes = { "aria-label": "Run shown", "data-testid": "live-run" };
  return createSelect(options, run, (chosen) => picked(Number(chosen)), attributes);
}

/** Return the button that follows the newest generation. */
export function createNewestButton(isPressed, onclick) {
  return createButton("Newest", onclick, {
    "aria-pressed": String(isPressed),
    title: "Follow the newest generation",
    "data-testid": "live-newest",
  });
}

/** Return the link to the World tab, which is visible after the run is saved. */
export function createWorldLink() {
  return el(
    "a",
    { class: "button quiet", hidden: true, "data-testid": "live-open-world" },
    "Open in World",
  );
}

/** Return a whole number of an address, or null. */
export function parseWholeNumber(text) {
  return /^\d+$/.test(text ?? "") ? Number(text) : null;
}
