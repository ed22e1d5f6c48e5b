/** What the user does, announced to the tour. A page without a tour ignores it. */

/** @type {Set<(act: string) => void>} */
const listeners = new Set();

/** Announce an act, for example "compare". */
export function announce(act) {
  for (const listener of listeners) listener(act);
}

/** @param {(act: string) => void} listener */
export function listenToActs(listener) {
  listeners.add(listener);
}
