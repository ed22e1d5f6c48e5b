/** The panel of a sweep: progress, Stop, and a link to the results. */

import { el, getJSON, showMessage, postJSON } from "./common.js";
import { formatDuration } from "./sweep_dialog.js";

// Milliseconds between two requests.
const POLL_INTERVAL = 500;
const STATES = {
  preparing: ["Preparing", ""],
  running: ["Running", "good"],
  done: ["Done", "good"],
  stopped: ["Stopped", ""],
  failed: ["Failed", "warm"],
};

export class SweepPanel {
  /**
   * @param {HTMLElement} root is filled
   * @param {string} name of the study
   * @param {() => void} onGone called when the server has another sweep
   */
  constructor(root, name, onGone) {
    this.name = name;
    this.onGone = onGone;
    this.aborted = new AbortController();
    this.createElements();
    root.replaceChildren(this.createCard());
    this.poll();
  }

  createElements() {
    this.title = el("h1");
    this.badge = el("span", { "data-testid": "sweep-state" });
    this.stop = el(
      "button",
      {
        type: "button",
        class: "danger",
        "data-testid": "sweep-stop",
        onclick: () => this.stopSweep(),
      },
      "Stop",
    );
    this.open = el(
      "a",
      { class: "button primary", "data-testid": "sweep-results", hidden: true },
      "Open in Results",
    );
    this.progress = el("progress", { "aria-label": "Progress of the sweep", max: 1 });
    this.count = el("span", { class: "number", "data-testid": "sweep-count" });
    this.fault = el("p", { class: "fault", role: "status" });
    this.hint = el(
      "p",
      { class: "soft" },
      "The sweep continues if you leave or close this page. You can open finished runs at " +
        "any time. If you stop the sweep, finished runs stay stored.",
    );
  }

  createCard() {
    return el(
      "section",
      { class: "card live-head", "data-testid": "sweep-head" },
      el(
        "div",
        { class: "row" },
        this.title,
        this.badge,
        el("span", { class: "soft" }, this.name),
        el("span", { class: "spread" }),
        this.stop,
        this.open,
      ),
      el("div", { class: "row live-progress" }, this.progress, this.count),
      this.fault,
      this.hint,
    );
  }

  stopSweep() {
    postJSON("/api/sweep/stop", {}).catch((error) => showMessage(error.message, "error"));
  }

  /** Request the state of the sweep until it ends. */
  async poll() {
    const { signal } = this.aborted;
    const { sweep } = await getJSON("/api/sweep", signal);
    if (sweep?.name !== this.name) return this.onGone();
    this.show(sweep);
    const isActive = ["preparing", "running"].includes(sweep.state);
    if (isActive) setTimeout(() => signal.aborted || this.poll(), POLL_INTERVAL);
  }

  show({ state, message, fields, share, stored, runs, seconds_left: secondsLeft }) {
    const [word, tone] = STATES[state];
    this.badge.className = `badge ${tone}`;
    this.badge.textContent = word;
    this.fault.textContent = message;
    this.title.textContent = `Sweep of ${fields.join(" and ")}`;
    this.progress.value = share;
    const timeLeft = secondsLeft === null ? "" : `, ${formatDuration(secondsLeft)} left`;
    this.count.textContent = `${stored} of ${runs} runs${timeLeft}`;
    this.stop.hidden = this.hint.hidden = !["preparing", "running"].includes(state);
    this.open.hidden = !stored;
    this.open.href = `#/results?${new URLSearchParams({ study: this.name })}`;
  }

  /** Do nothing: the panel requests its state itself. */
  update() {}

  close() {
    this.aborted.abort();
  }
}
