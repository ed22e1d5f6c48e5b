/** The guided tour at the first visit: a line above the picture that follows the user's acts. */

import { listenToActs } from "./activity.js";
import { el } from "./common.js";

const STORAGE_KEY = "baldwinlab.tour";
const ENDED = "ended";

// The act that ends each step, and the views in which the step is visible.
const STEPS = [
  {
    act: "play",
    views: ["world"],
    text: "Press the round button, or Space, to pause.",
  },
  {
    act: "select-agent",
    views: ["world"],
    text:
      "Click an agent to see what it senses and learns. Or press A, and choose one from the list.",
  },
  {
    act: "change-generation",
    views: ["world"],
    text: "Agents of generation 0 are random. Go there with the slider or the arrows at " +
      "“generation”.",
  },
  {
    act: "compare",
    views: ["world"],
    text:
      "Compare shows two populations with the same start. Press it, or C, to hide or show the " +
      "second one.",
  },
  {
    act: "open-results",
    views: ["world"],
    text: "One lifetime can be due to chance. Open the tab Results to compare all runs.",
  },
  {
    act: "start-run",
    views: ["results", "live"],
    text: "Now evolve agents yourself: open the tab Live run, change a setting, and press Start.",
  },
];
const END = "The tour is over. “What is this?” explains each tab, and can repeat the tour.";

export class Tour {
  /** @param {HTMLElement} opener gets the focus when the tour ends */
  constructor(opener) {
    this.opener = opener;
    this.view = "";
    // The index of the current step, STEPS.length for the end, or null without a tour.
    this.step = readStep();
    this.text = el("p", { role: "status", "data-testid": "tour-text" });
    this.next = createButton("Next", "tour-next", () => this.goTo(this.step + 1));
    this.skip = createButton("Skip", "tour-skip", () => this.end());
    this.root = el(
      "section",
      { class: "tour", "aria-label": "Tour", hidden: true, "data-testid": "tour" },
      this.text,
      el("div", { class: "row" }, this.next, this.skip),
    );
    listenToActs((act) => this.handleAct(act));
  }

  /** Hide the tour until another view is announced. */
  leaveView() {
    this.view = "";
    this.show();
  }

  handleAct(act) {
    if (act.startsWith("open-")) this.view = act.slice("open-".length);
    if (this.step !== null && STEPS[this.step]?.act === act) this.goTo(this.step + 1);
    else this.show();
  }

  /** Start the tour, also if it was skipped before. */
  start() {
    this.goTo(0);
    if (this.root.hidden) location.hash = "#/world";
  }

  goTo(step) {
    this.step = step;
    // The last message is not repeated at the next visit.
    writeStep(step < STEPS.length ? step : ENDED);
    this.show();
  }

  end() {
    this.step = null;
    writeStep(ENDED);
    this.show();
    this.opener.focus();
  }

  show() {
    const isOver = this.step === STEPS.length;
    const step = STEPS[this.step];
    this.root.hidden = !isOver && !step?.views.includes(this.view);
    if (this.root.hidden) return;
    const text = isOver ? END : `${this.step + 1} of ${STEPS.length}: ${step.text}`;
    // The same text is not announced twice.
    if (this.text.textContent !== text) this.text.textContent = text;
    this.next.hidden = isOver;
    this.skip.textContent = isOver ? "Close" : "Skip";
    this.skip.title = isOver ? "" : "Skip the tour";
  }
}

function createButton(text, testId, onclick) {
  return el("button", { type: "button", "data-testid": testId, onclick }, text);
}

/** Return the step of an earlier visit, 0 at the first visit, or null after the tour. */
function readStep() {
  try {
    const stored = localStorage.getItem(STORAGE_KEY);
    return stored === ENDED ? null : Math.min(Number(stored) || 0, STEPS.length - 1);
  } catch {
    // The browser stores nothing, so each visit is the first one.
    return 0;
  }
}

function writeStep(step) {
  try {
    localStorage.setItem(STORAGE_KEY, step);
  } catch {
    // The tour works without storage.
  }
}
