/** What the user does, announced to the tour. A page without a tour ignores it. */

const activities = new EventTarget();

/** Announce an act, for example "compare". */
export function announce(act) {
  activities.dispatchEvent(new CustomEvent("act", { detail: act }));
}

/** @param {(act: string) => void} listener */
export function listenToActs(listener) {
  activities.addEventListener("act", ({ detail }) => listener(detail));
}
