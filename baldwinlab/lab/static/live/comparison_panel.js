/** The panel of a comparison: progress, and at the end its result. */

import { createButton, el, getJSON, postJSON, showMessage } from "../core/common.js";
import { formatDuration } from "./comparison_dialog.js";
import { createComparisonTable, formatAnswer } from "../results/comparison.js";
import { drawMedians } from "../results/results_curves.js";
import { showState } from "./live_feed.js";

// Milliseconds between two requests.
const POLL_INTERVAL = 500;

export class ComparePanel {
  /**
   * @param {HTMLElement} root is filled
   * @param {string} name of the study
   * @param {() => void} onGone called when the server has another comparison
   */
  constructor(root, name, onGone) {
    this.name = name;
    this.onGone = onGone;
    this.aborted = new AbortController();
    this.createElements();
    this.card = this.createCard();
    this.chart = null;
    root.replaceChildren(this.card);
    this.poll().catch((error) =>
      this.aborted.signal.aborted || showMessage(error.message, "error")
    );
  }

  createElements() {
    this.title = el("h1");
    this.badge = el("span", { "data-testid": "compare-state" });
    this.stop = createButton("Stop", () => this.stopRuns(), {
      class: "danger",
      "data-testid": "compare-stop",
    });
    this.open = el(
      "a",
      { class: "button primary", "data-testid": "compare-results", hidden: true },
      "Open in Results",
    );
    this.progress = el("progress", { "aria-label": "Progress of the comparison", max: 1 });
    this.count = el("span", { class: "number", "data-testid": "compare-count" });
    this.fault = el("p", { class: "fault", role: "status" });
    this.answer = el("strong", { role: "status", "data-testid": "compare-answer" });
    this.hint = el(
      "p",
      { class: "soft" },
      "The comparison continues if you leave this page. If you stop it, finished runs stay stored.",
    );
  }

  createCard() {
    return el(
      "section",
      { class: "card live-head", "data-testid": "compare-head" },
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
      this.answer,
      this.hint,
    );
  }

  stopRuns() {
    postJSON("api/comparison/stop", {}).catch((error) => showMessage(error.message, "error"));
  }

  /** Request the state of the comparison until it ends. */
  async poll() {
    const { signal } = this.aborted;
    const { comparison } = await getJSON("api/comparison", signal);
    if (comparison?.name !== this.name) return this.onGone();
    this.show(comparison);
    const isActive = ["preparing", "running"].includes(comparison.state);
    if (isActive) setTimeout(() => signal.aborted || this.poll(), POLL_INTERVAL);
    else if (comparison.stored) await this.showResult();
  }

  /** Show the answer and the curves of the stored runs, and the table, as in Results. */
  async showResult() {
    this.answer.textContent = "Comparing the runs …";
    const query = new URLSearchParams({ study: this.name });
    const results = await getJSON(`api/results?${query}`, this.aborted.signal);
    const { comparison } = results;
    this.answer.textContent = formatAnswer(comparison);
    const plot = el("div", { "data-testid": "compare-curve" });
    const verdict = el(
      "div",
      {},
      this.answer,
      el("p", { class: "soft" }, comparison.statistic),
    );
    this.card.append(el("div", { class: "compare-result" }, plot, verdict));
    this.card.after(createComparisonTable(comparison, true));
    // The chart needs the width of its element on the page.
    this.chart = drawMedians(plot, results);
  }

  show({ state, message, subject, share, stored, runs, seconds_left: secondsLeft }) {
    showState(this.badge, state);
    this.fault.textContent = message;
    this.title.textContent = `Comparison of ${subject}`;
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
    this.chart?.destroy();
  }
}
