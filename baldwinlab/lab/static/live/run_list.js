/** The dialog of the live runs of the lab, which continue without a page. */

import {
  createButton,
  el,
  formatNumber,
  getJSON,
  openDialog,
  postJSON,
  request,
  showMessage,
} from "../core/common.js";

// Milliseconds between two requests of the list.
const REFRESH_INTERVAL = 1000;
const ACTIVE_STATES = ["preparing", "running", "paused"];

/** Return the text of a run: "evo/A, seed 0: 63 of 100 generations, running, 2 MB". */
export function describeRun({ experiment, seed, generations_done: done, state, bytes, saved_as }) {
  const { generations } = experiment.evolution;
  const progress = `${formatNumber(done)} of ${formatNumber(generations)} generations`;
  const stored = saved_as ? `, saved as ${saved_as}` : "";
  return `${experiment.name}, seed ${seed}: ${progress}, ${state}, ` +
    `${formatNumber(Math.ceil(bytes / 1e6))} MB${stored}`;
}

/** Return the button that opens the list. */
export function createRunListButton(/** @type {AbortSignal} */ signal) {
  const open = () => new RunList(signal);
  return createButton("Runs …", open, { class: "quiet", "data-testid": "runs-open" });
}

class RunList {
  constructor(/** @type {AbortSignal} */ signal) {
    this.rows = new Map();
    this.list = el("ul", { class: "live-runs" });
    this.limits = el("p", { class: "soft" });
    const close = () => this.dialog.close();
    this.dialog = el(
      "dialog",
      { "aria-label": "Live runs", "data-testid": "runs" },
      el(
        "div",
        { class: "live-save" },
        el("h2", {}, "Live runs"),
        this.list,
        this.limits,
        createButton("Close", close),
      ),
    );
    this.timer = setInterval(() => this.refresh(), REFRESH_INTERVAL);
    signal.addEventListener("abort", close, { once: true });
    openDialog(this.dialog, () => clearInterval(this.timer));
    this.refresh();
  }

  async refresh() {
    const { runs, limits } = await getJSON("api/live");
    this.limits.textContent = (runs.length ? "" : "There is no live run. ") +
      "A run continues without a page. The lab stores at most " +
      `${limits.runs} runs and ${formatNumber(limits.bytes / 1e9)} GB, of which ` +
      `${limits.active} can be active. A new run replaces saved runs, and then the oldest ended ` +
      "runs. When the lab is closed, runs are lost that are not saved as a study.";
    const ids = runs.map(({ id }) => id);
    for (const [id, { element }] of this.rows) {
      if (ids.includes(id)) continue;
      element.remove();
      this.rows.delete(id);
    }
    for (const run of runs) {
      if (!this.rows.has(run.id)) this.add(run.id);
      const { link, stop, remove } = this.rows.get(run.id);
      link.textContent = describeRun(run);
      stop.hidden = !ACTIVE_STATES.includes(run.state);
      remove.hidden = !stop.hidden;
    }
  }

  /** Add a row that `refresh` fills. */
  add(id) {
    const address = `api/live/${encodeURIComponent(id)}`;
    const link = el("a", { href: `#/live?id=${id}`, onclick: () => this.dialog.close() });
    const stop = this.createAction("Stop", () => postJSON(`${address}/stop`, {}));
    const remove = this.createAction("Remove", () => request(address, { method: "DELETE" }));
    const element = el("li", { class: "row", "data-testid": `run-${id}` }, link, stop, remove);
    this.rows.set(id, { element, link, stop, remove });
    this.list.append(element);
  }

  createAction(label, act) {
    const run = () =>
      act().then(() => this.refresh()).catch((error) => showMessage(error.message, "error"));
    return createButton(label, run, { class: "quiet", hidden: true });
  }
}
