/** The dialog of a sweep: fields, values, size and name. */

import { el, formatNumber, postJSON } from "./common.js";
import { createDownloadButton } from "./downloads.js";

// Milliseconds after the last change.
const ESTIMATE_DELAY = 300;
const MAX_FIELDS = 2;

/**
 * @param {{preset: string, experiment: object, runs: number, seed: number}} order from the form
 * @param {Object<string, any[]>} swept the values of each field, from the address
 * @param {(swept: Object<string, any[]>|null) => void} changed called after a change; null when the
 *   dialog closes
 * @param {(name: string) => void} started called with the name of the study
 */
export function openSweepDialog(order, swept, changed, started) {
  const fieldValues = new Map(listFields(order.experiment).filter(([path]) => path !== "name"));
  const rows = Array.from({ length: MAX_FIELDS }, (_, number) =>
    createFieldRow(fieldValues, number, Object.entries(swept)[number]),
  );
  const name = el("input", {
    value: `live/sweep-${`${order.preset}-${order.seed}`.replace(/[^A-Za-z0-9+_-]+/g, "-")}`,
    spellcheck: "false",
    maxlength: 100,
    "data-testid": "sweep-name",
  });
  const size = el("p", { role: "status", "data-testid": "sweep-size" });
  const fault = el("p", { class: "fault", role: "alert", "data-testid": "sweep-fault" });
  const start = el(
    "button",
    { type: "submit", class: "primary", "data-testid": "sweep-start" },
    "Start the sweep",
  );
  let toml;
  let waiting = 0;
  let latestRequest = 0;
  const save = createDownloadButton("sweep.toml", () => toml);
  const commandHint = el(
    "p",
    { class: "soft" },
    "To run this sweep on another machine, save this file and run ",
    el("code", {}, "baldwinlab sweep sweep.toml"),
    ".",
  );

  const fields = () =>
    Object.fromEntries(
      rows
        .filter(({ field }) => field.value)
        .map(({ field, values }) => [field.value, parseValues(values.value)]),
    );
  const showPlan = (plan, sentence) => {
    toml = plan?.toml;
    size.textContent = plan ? describePlan(plan) : "";
    fault.textContent = sentence;
    start.disabled = save.disabled = !plan;
  };
  const check = () => {
    clearTimeout(waiting);
    changed(fields());
    const request = ++latestRequest;
    showPlan(null, "");
    if (!Object.keys(fields()).length) return;
    size.textContent = "Estimating …";
    waiting = setTimeout(async () => {
      try {
        const plan = await postJSON("/api/sweep/plan", { ...order, fields: fields() });
        if (request === latestRequest) showPlan(plan.problem ? null : plan, plan.problem ?? "");
      } catch (error) {
        if (request === latestRequest) showPlan(null, error.message);
      }
    }, ESTIMATE_DELAY);
  };
  const form = el(
    "form",
    { class: "live-save" },
    el("h2", {}, "Sweep a field"),
    el(
      "p",
      { class: "soft" },
      "A sweep runs the experiment once for each value of a field, or for each pair of " +
        "values of two fields. The number of runs applies to each of them. The results " +
        "become a study.",
    ),
    ...rows.map(({ element }) => element),
    el(
      "label",
      { class: "field" },
      el("span", {}, "Name of the study in the folder of this lab"),
      name,
    ),
    size,
    commandHint,
    fault,
    el(
      "div",
      { class: "row" },
      save,
      el("span", { class: "spread" }),
      el("button", { type: "button", class: "quiet", onclick: () => dialog.close() }, "Cancel"),
      start,
    ),
  );
  const dialog = el(
    "dialog",
    { "aria-label": "Sweep a field", "data-testid": "sweep-dialog" },
    form,
  );
  for (const { element } of rows) element.addEventListener("input", check);
  form.addEventListener("submit", async (event) => {
    event.preventDefault();
    start.disabled = true;
    try {
      const { name: study } = await postJSON("/api/sweep", {
        ...order,
        fields: fields(),
        name: name.value.trim(),
      });
      dialog.close();
      started(study);
    } catch (error) {
      fault.textContent = error.message;
      start.disabled = false;
    }
  });
  dialog.addEventListener("close", () => {
    clearTimeout(waiting);
    latestRequest++;
    dialog.remove();
    changed(null);
  });
  document.body.append(dialog);
  dialog.showModal();
  check();
  return dialog;
}

/** Return the controls of a field and its values. */
function createFieldRow(fieldValues, number, initial) {
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
    { class: "field", hidden: !field.value },
    el("span", {}, "values, separated by commas"),
    values,
  );
  field.addEventListener("change", () => {
    valuesField.hidden = !field.value;
    values.value = field.value ? formatValues(proposeValues(fieldValues.get(field.value))) : "";
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
    ),
  };
}

/** Return all fields that can be swept, by path, with their values. */
function listFields(tree, path = "") {
  const table =
    tree !== null &&
    typeof tree === "object" &&
    (!Array.isArray(tree) || tree.some((item) => typeof item === "object"));
  if (!table) return tree === null ? [] : [[path, tree]];
  return Object.entries(tree).flatMap(([key, below]) =>
    listFields(below, path ? `${path}.${key}` : key),
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
