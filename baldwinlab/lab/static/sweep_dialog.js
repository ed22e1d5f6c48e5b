/** The dialog of a sweep: fields, values, size and name. */

import { el, formatNumber, postJSON } from "./common.js";
import { createDownloadButton } from "./downloads.js";

// Milliseconds after the last change.
const ESTIMATE_DELAY = 300;
const MAX_FIELDS = 2;

/**
 * Open the dialog of a sweep.
 * @param {{preset: string, experiment: object, runs: number, seed: number}} order from the form
 * @param {Object<string, any[]>} swept the values of each field, from the address
 * @param {(path: string) => string[]} listOptions returns the options of a choice, or []
 * @param {(swept: Object<string, any[]>|null) => void} changed called after a change; null when the
 *   dialog closes
 * @param {(name: string) => void} started called with the name of the study
 * @returns {HTMLDialogElement}
 */
export function openSweepDialog(order, swept, listOptions, changed, started) {
  const { element } = new SweepDialog(order, swept, listOptions, changed, started);
  return element;
}

class SweepDialog {
  constructor(order, swept, listOptions, changed, started) {
    this.order = order;
    this.listOptions = listOptions;
    this.changed = changed;
    this.started = started;
    this.timer = 0;
    this.latestRequest = 0;
    this.toml = "";
    this.createControls(swept);
    const form = this.createForm();
    this.element = el(
      "dialog",
      { "aria-label": "Compare values", "data-testid": "sweep-dialog" },
      form,
    );
    for (const { element } of this.rows) element.addEventListener("input", () => this.check());
    form.addEventListener("submit", (event) => {
      event.preventDefault();
      this.start();
    });
    this.element.addEventListener("close", () => this.close());
    document.body.append(this.element);
    this.element.showModal();
    this.check();
  }

  createControls(swept) {
    const { preset, seed, experiment } = this.order;
    const fieldValues = new Map(listFields(experiment).filter(([path]) => path !== "name"));
    this.rows = Array.from({ length: MAX_FIELDS }, (_, number) =>
      createFieldRow(fieldValues, number, Object.entries(swept)[number], this.listOptions),
    );
    this.name = el("input", {
      value: `live/sweep-${`${preset}-${seed}`.replace(/[^A-Za-z0-9+_-]+/g, "-")}`,
      spellcheck: "false",
      maxlength: 100,
      "data-testid": "sweep-name",
    });
    this.size = el("p", { role: "status", "data-testid": "sweep-size" });
    this.fault = el("p", { class: "fault", role: "alert", "data-testid": "sweep-fault" });
    this.startButton = el(
      "button",
      { type: "submit", class: "primary", "data-testid": "sweep-start" },
      "Start the sweep",
    );
    this.saveButton = createDownloadButton("sweep.toml", () => this.toml);
  }

  createForm() {
    const close = () => this.element.close();
    return el(
      "form",
      { class: "live-save" },
      el("h2", {}, "Compare values"),
      el(
        "p",
        { class: "soft" },
        "A sweep runs the experiment once for each value of a field, or for each pair of " +
          "values of two fields. The number of runs applies to each of them. The results " +
          "become a study.",
      ),
      ...this.rows.map(({ element }) => element),
      el(
        "label",
        { class: "field" },
        el("span", {}, "Name of the study in the folder of this lab"),
        this.name,
      ),
      this.size,
      createCommandHint(),
      this.fault,
      el(
        "div",
        { class: "row" },
        this.saveButton,
        el("span", { class: "spread" }),
        el("button", { type: "button", class: "quiet", onclick: close }, "Cancel"),
        this.startButton,
      ),
    );
  }

  /** Return the values of each chosen field. */
  readFields() {
    const chosenRows = this.rows.filter(({ field }) => field.value);
    return Object.fromEntries(
      chosenRows.map(({ field, values }) => [field.value, parseValues(values.value)]),
    );
  }

  /** Request the plan of the sweep soon after the last change. */
  check() {
    clearTimeout(this.timer);
    const fields = this.readFields();
    this.changed(fields);
    const request = ++this.latestRequest;
    this.showPlan(null, "");
    if (!Object.keys(fields).length) return;
    this.size.textContent = "Estimating …";
    this.timer = setTimeout(() => this.requestPlan(request), ESTIMATE_DELAY);
  }

  async requestPlan(request) {
    const order = { ...this.order, fields: this.readFields() };
    let plan = null;
    let problem = "";
    try {
      plan = await postJSON("/api/sweep/plan", order);
      problem = plan.problem ?? "";
    } catch (error) {
      problem = error.message;
    }
    // A later change has its own request.
    if (request === this.latestRequest) this.showPlan(problem ? null : plan, problem);
  }

  /** Show a plan, or the problem of a sweep that has no plan. */
  showPlan(plan, problem) {
    this.toml = plan?.toml;
    this.size.textContent = plan ? describePlan(plan) : "";
    this.fault.textContent = problem;
    this.startButton.disabled = this.saveButton.disabled = !plan;
  }

  async start() {
    this.startButton.disabled = true;
    const name = this.name.value.trim();
    try {
      const sweep = await postJSON("/api/sweep", {
        ...this.order,
        fields: this.readFields(),
        name,
      });
      this.element.close();
      this.started(sweep.name);
    } catch (error) {
      this.fault.textContent = error.message;
      this.startButton.disabled = false;
    }
  }

  close() {
    clearTimeout(this.timer);
    // Responses that arrive later are ignored.
    this.latestRequest++;
    this.element.remove();
    this.changed(null);
  }
}

function createCommandHint() {
  return el(
    "p",
    { class: "soft" },
    "To run this sweep on another machine, save this file and run ",
    el("code", {}, "baldwinlab sweep sweep.toml"),
    ".",
  );
}

/** Return the controls of a field and its values. */
function createFieldRow(fieldValues, number, initial, listOptions) {
  const title = number ? "second field (optional)" : "field";
  const field = el(
    "select",
    { "data-testid": `sweep-field-${number}` },
    el("option", { value: "" }, number ? "none" : "choose a field"),
    ...[...fieldValues.keys()].map((path) => el("option", { value: path }, path)),
  );
  const values = el("input", {
    spellcheck: "false",
    autocomplete: "off",
    "data-testid": `sweep-values-${number}`,
  });
  if (initial && fieldValues.has(initial[0])) {
    field.value = initial[0];
    values.value = formatValues(initial[1]);
  }
  const valuesField = el(
    "label",
    { class: "field" },
    el("span", {}, "values, separated by commas"),
    values,
  );
  const ticks = el("fieldset", { class: "sweep-ticks", "data-testid": `sweep-ticks-${number}` });
  // A choice has ticks instead of a text.
  const showInput = () => {
    const options = field.value ? listOptions(field.value) : [];
    ticks.hidden = !options.length;
    valuesField.hidden = !field.value || options.length > 0;
    ticks.replaceChildren(...createTicks(options, values));
  };
  showInput();
  field.addEventListener("change", () => {
    values.value = field.value ? formatValues(proposeValues(fieldValues.get(field.value))) : "";
    showInput();
    field.dispatchEvent(new Event("input", { bubbles: true }));
  });
  return {
    field,
    values,
    element: el(
      "div",
      { class: "sweep-field" },
      el("label", { class: "field" }, el("span", {}, title), field),
      valuesField,
      ticks,
    ),
  };
}

/** Return a checkbox for each option. They change the text of `values`. */
function createTicks(options, values) {
  const selected = parseValues(values.value);
  const inputs = options.map((value) =>
    el("input", {
      type: "checkbox",
      value,
      checked: selected.includes(value),
      oninput: () =>
        (values.value = formatValues(
          inputs.filter(({ checked }) => checked).map((input) => input.value),
        )),
    }),
  );
  return inputs.map((input) => el("label", { class: "inline" }, input, input.value));
}

/** Return all fields that can be swept, by path, with their values. */
function listFields(tree, path = "") {
  if (tree === null) return [];
  // A list of tables has fields, a list of numbers is a value.
  const hasFields =
    typeof tree === "object" &&
    (!Array.isArray(tree) || tree.some((item) => typeof item === "object"));
  if (!hasFields) return [[path, tree]];
  return Object.entries(tree).flatMap(([key, child]) =>
    listFields(child, path ? `${path}.${key}` : key),
  );
}

/** Return some initial values. */
function proposeValues(value) {
  if (typeof value === "boolean") return [false, true];
  if (typeof value !== "number") return [value];
  if (value === 0) return [0, 1];
  const scaled = Number.isInteger(value)
    ? [Math.ceil(value / 2), value, 2 * value]
    : [value / 2, value, 2 * value].map((item) => Number(item.toPrecision(6)));
  return [...new Set(scaled)];
}

function formatValues(values) {
  return values
    .map((value) => (typeof value === "string" ? value : JSON.stringify(value)))
    .join(", ");
}

/** Parse `0, 0.1`, `true, false`, `rank, roulette` or `[10], [5, 5]`. */
function parseValues(text) {
  try {
    return JSON.parse(`[${text}]`);
  } catch {
    return text
      .split(",")
      .map((item) => item.trim())
      .filter(Boolean)
      .map((item) => {
        try {
          return JSON.parse(item);
        } catch {
          return item;
        }
      });
  }
}

function describePlan({ points, runs, seconds, workers, disk, note }) {
  const sentence = note ? ` ${note}` : "";
  const size = `${formatNumber(points)} points, ${formatNumber(runs)} runs in total`;
  const cores = workers === 1 ? "1 core" : `${workers} cores`;
  const space = `${formatNumber(disk / 1e6)} MB of disk space`;
  return `${size}: ${formatDuration(seconds)} on ${cores}, ${space}.${sentence}`;
}

/** Return a duration as text: "about 40 s". */
export function formatDuration(seconds) {
  if (seconds < 1) return "less than a second";
  if (seconds < 100) return `about ${Math.round(seconds)} s`;
  if (seconds < 6000) return `about ${Math.round(seconds / 60)} min`;
  return `about ${Math.round(seconds / 3600)} hours`;
}
