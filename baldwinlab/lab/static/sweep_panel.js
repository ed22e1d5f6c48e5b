/** The panel of a sweep: progress, Stop, and a link to the results. */

import { el, getJSON, showMessage, postJSON } from "./common.js";
import { formatDuration } from "./sweep_dialog.js";

// Milliseconds.
const POLL_INTERVAL = 500;
const STATES = {
  preparing: ["Preparing", ""],
  running: ["Running", "good"],
  done: ["Done", "good"],
  stopped: ["Stopped", ""],
  failed: ["Failed", "warm"],
};

/**
 * @param {HTMLElement} root is filled
 * @param {string} name of the study
 * @param {() => void} onGone called when the server has another sweep
 * @returns {{update: () => void, close: () => void}}
 */
export function createSweepPanel(root, name, onGone) {
  const aborted = new AbortController();
  const title = el("h1");
  const badge = el("span", { "data-testid": "sweep-state" });
  const stop = el(
    "button",
    { type: "button", class: "danger", "data-testid": "sweep-stop" },
    "Stop",
  );
  const open = el(
    "a",
    { class: "button primary", "data-testid": "sweep-results", hidden: true },
    "Open in Results",
  );
  const progress = el("progress", { "aria-label": "Progress of the sweep", max: 1 });
  const count = el("span", { class: "number", "data-testid": "sweep-count" });
  const fault = el("p", { class: "fault", role: "status" });
  const hint = el(
    "p",
    { class: "soft" },
    "The sweep continues if you leave or close this page. You can open finished runs at " +
      "any time. If you stop the sweep, finished runs stay stored.",
  );
  root.replaceChildren(
    el(
      "section",
      { class: "card live-head", "data-testid": "sweep-head" },
      el(
        "div",
        { class: "row" },
        title,
        badge,
        el("span", { class: "soft" }, name),
        el("span", { class: "spread" }),
        stop,
        open,
      ),
      el("div", { class: "row live-progress" }, progress, count),
      fault,
      hint,
    ),
  );
  stop.addEventListener("click", () =>
    postJSON("/api/sweep/stop", {}).catch((error) => showMessage(error.message, "error")),
  );

  const show = (sweep) => {
    const [word, kind] = STATES[sweep.state];
    badge.className = `badge ${kind}`;
    badge.textContent = word;
    fault.textContent = sweep.message;
    title.textContent = `Sweep of ${sweep.fields.join(" and ")}`;
    progress.value = sweep.share;
    const left = sweep.seconds_left === null ? "" : `, ${formatDuration(sweep.seconds_left)} left`;
    count.textContent = `${sweep.stored} of ${sweep.runs} runs${left}`;
    stop.hidden = hint.hidden = !["preparing", "running"].includes(sweep.state);
    open.hidden = !sweep.stored;
    open.href = `#/results?${new URLSearchParams({ study: name })}`;
  };
  const poll = async () => {
    const { sweep } = await getJSON("/api/sweep", aborted.signal);
    if (sweep?.name !== name) return onGone();
    show(sweep);
    if (!stop.hidden) setTimeout(() => aborted.signal.aborted || poll(), POLL_INTERVAL);
  };
  poll();
  return { update() {}, close: () => aborted.abort() };
}
