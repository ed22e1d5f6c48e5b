/** The list of the runs of a live run. */

import { el } from "./common.js";

/**
 * Return the list of runs, or null for a single run.
 * @param {(run: number) => void} picked
 */
export function createRunPicker(runs, run, picked) {
  if (runs === 1) return null;
  const options = Array.from(
    { length: runs },
    (_, number) => el("option", { value: number }, `run ${number}`),
  );
  const picker = el("select", { "aria-label": "Run shown", "data-testid": "live-run" }, ...options);
  picker.value = String(run);
  picker.addEventListener("change", () => picked(Number(picker.value)));
  return picker;
}

/** Return a whole number of an address, or null. */
export function parseWholeNumber(text) {
  return /^\d+$/.test(text ?? "") ? Number(text) : null;
}
