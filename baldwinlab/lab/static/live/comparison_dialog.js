/** The dialog of a comparison: presets or values, number of runs, size and name. */

import {
  createButton,
  createField,
  el,
  formatNumber,
  openDialog,
  postJSON,
} from "../core/common.js";
import { ComparedPresets, ComparedValues } from "./comparison_kinds.js";
import { createDownloadButton } from "../core/downloads.js";
import { createNumberField } from "./setup_fields.js";

// Milliseconds after the last change.
const ESTIMATE_DELAY = 300;
const MAX_RUNS = 50;
const TITLES = { presets: "Presets", fields: "Values of a setting" };

/** The dialog, which opens when it is created. */
export class CompareDialog {
  /**
   * @param {object} form
   * @param {{preset: string, experiment: object, runs: number, seed: number}} form.order
   * @param {{name: string, paper?: string, description: string}[]} form.presets
   * @param {Object<string, string>} form.choices the first choices, in words, by preset
   * @param {(path: string) => string[]} form.listOptions returns the options of a choice, or []
   * @param {{presets?: string[], fields?: Object<string, any[]>}} compared from the address
   * @param {(compared: object|null) => void} changed called after a change; null when the dialog
   *   closes
   * @param {(name: string) => void} started called with the name of the study
   */
  constructor({ order, presets, choices, listOptions }, compared, changed, started) {
    this.order = { ...order };
    this.changed = changed;
    this.started = started;
    this.timer = 0;
    this.latestRequest = 0;
    this.toml = "";
    this.kind = compared.fields ? "fields" : "presets";
    this.parts = {
      presets: new ComparedPresets(presets, choices, compared.presets ?? [order.preset]),
      fields: new ComparedValues(order.experiment, compared.fields ?? {}, listOptions),
    };
    this.createControls();
    const form = this.createForm();
    this.element = el(
      "dialog",
      { "aria-label": "Compare", class: "compare-dialog", "data-testid": "compare-dialog" },
      form,
    );
    form.addEventListener("submit", (event) => {
      event.preventDefault();
      this.start();
    });
    openDialog(this.element, () => this.close());
    this.showKind();
  }

  createControls() {
    const { runs } = this.order;
    this.runs = createNumberField("Runs of each", "compare-runs", runs, 1, MAX_RUNS, (value) => {
      this.order.runs = value;
    });
    this.name = el("input", {
      value: proposeName(),
      spellcheck: "false",
      maxlength: 100,
      "data-testid": "compare-name",
    });
    this.size = el("p", { role: "status", "data-testid": "compare-size" });
    this.changes = el("p", { role: "status", "data-testid": "compare-changes" });
    this.note = el("p", { role: "status", "data-testid": "compare-note" });
    this.fault = el("p", { class: "fault", role: "alert", "data-testid": "compare-fault" });
    this.command = el("code", { "data-testid": "compare-command" });
    this.hint = el("p", { class: "soft" }, "The same on another machine: ", this.command);
    this.startButton = createButton("Compare", null, {
      type: "submit",
      class: "primary",
      "data-testid": "compare-start",
    });
    this.saveButton = createDownloadButton("sweep.toml", () => this.toml);
  }

  createForm() {
    const nameField = createField("Name of the study in the folder of this lab", this.name);
    const content = el(
      "div",
      { class: "compare-content" },
      this.createKindSwitch(),
      ...Object.values(this.parts).map(({ element }) => element),
      el("div", { class: "compare-field" }, this.runs, nameField),
    );
    content.addEventListener("input", () => this.check());
    return el(
      "form",
      { class: "live-save" },
      el("h2", {}, "Compare"),
      content,
      this.size,
      this.changes,
      this.note,
      this.fault,
      this.hint,
      el(
        "div",
        { class: "row" },
        this.saveButton,
        el("span", { class: "spread" }),
        createButton("Cancel", () => this.element.close(), { class: "quiet" }),
        this.startButton,
      ),
    );
  }

  createKindSwitch() {
    const createKind = ([kind, title]) =>
      el(
        "label",
        { class: "inline" },
        el("input", {
          type: "radio",
          name: "compare-kind",
          checked: kind === this.kind,
          "data-testid": `compare-kind-${kind}`,
          onchange: () => {
            this.kind = kind;
            this.showKind();
          },
        }),
        title,
      );
    return el(
      "fieldset",
      { class: "compare-ticks" },
      el("legend", { class: "visually-hidden" }, "What to compare"),
      ...Object.entries(TITLES).map(createKind),
    );
  }

  showKind() {
    for (const [kind, { element }] of Object.entries(this.parts))
      element.hidden = kind !== this.kind;
    this.check();
  }

  /** Request the plan of the comparison soon after the last change. */
  check() {
    clearTimeout(this.timer);
    const part = this.parts[this.kind];
    this.changed(part.read());
    const request = ++this.latestRequest;
    this.showPlan(null, "");
    if (!part.isComplete) return;
    this.size.textContent = "Estimating …";
    this.timer = setTimeout(() => this.requestPlan(request), ESTIMATE_DELAY);
  }

  createOrder() {
    return { ...this.order, ...this.parts[this.kind].read() };
  }

  async requestPlan(request) {
    let plan = null;
    let problem = "";
    try {
      plan = await postJSON("api/comparison/plan", this.createOrder());
      problem = plan.problem ?? "";
    } catch (error) {
      problem = error.message;
    }
    // A later change has its own request.
    if (request === this.latestRequest) this.showPlan(problem ? null : plan, problem);
  }

  /** Show a plan, or the problem of a comparison that has no plan. */
  showPlan(plan, problem) {
    this.toml = plan?.toml ?? "";
    this.size.textContent = plan ? describePlan(plan) : "";
    this.changes.textContent = plan?.changes.length
      ? `Each condition has the changes of the form: ${plan.changes.join(", ")}.`
      : "";
    this.note.textContent = plan?.note ?? "";
    this.fault.textContent = problem;
    this.command.textContent = plan?.command ?? "";
    this.hint.hidden = this.startButton.disabled = !plan;
    this.saveButton.hidden = !this.toml;
  }

  async start() {
    this.startButton.disabled = true;
    try {
      const order = { ...this.createOrder(), name: this.name.value.trim() };
      const { name } = await postJSON("api/comparison", order);
      this.element.close();
      this.started(name);
    } catch (error) {
      this.fault.textContent = error.message;
      this.startButton.disabled = false;
    }
  }

  close() {
    clearTimeout(this.timer);
    // Responses that arrive later are ignored.
    this.latestRequest++;
    this.changed(null);
  }
}

/** Return a name with the time, so that each comparison has its own study. */
function proposeName() {
  const time = new Date().toISOString().slice(0, 19).replace("T", "-").replaceAll(":", "");
  return `live/compare-${time}`;
}

function describePlan({ conditions, runs, seconds, workers, disk }) {
  const size = `${formatNumber(conditions)} conditions, ${formatNumber(runs)} runs in total`;
  const cores = workers === 1 ? "1 core" : `${workers} cores`;
  const space = `${formatNumber(disk / 1e6)} MB of disk space`;
  return `${size}: ${formatDuration(seconds)} on ${cores}, ${space}.`;
}

/** Return a duration as text: "about 40 s". */
export function formatDuration(seconds) {
  if (seconds < 1) return "less than a second";
  if (seconds < 100) return `about ${Math.round(seconds)} s`;
  if (seconds < 6000) return `about ${Math.round(seconds / 60)} min`;
  return `about ${Math.round(seconds / 3600)} hours`;
}
