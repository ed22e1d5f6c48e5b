/** The fields of an experiment in the form of a live run: the main settings, and all parameters. */

import {
  createButton,
  createSelect,
  el,
  isServerless,
  postJSON,
  showMessage,
} from "../core/common.js";
import { applyChanges, findChanges } from "../core/experiment_changes.js";
import { createForm } from "./form.js";
import { describeOrigin, listFrozenFiles } from "./freezer_panel.js";

// Shown before all settings, with titles that are complete outside their groups.
const MAIN_SETTINGS = {
  "learning.rule": "Learning rule",
  "learning.rate": "Learning rate",
  "evolution.mutation_size": "Mutation size",
  "senses.visual_radius": "Visual range",
};
// The inputs of the fields that need more than a number, a choice or a list.
const CUSTOM_FIELDS = {
  "evolution.founders": createFoundersField,
  schedule: createScheduleField,
};

export class ExperimentFields {
  /**
   * @param {() => void} changed called after each change
   * @param {AbortSignal} signal
   */
  constructor(changed, signal) {
    this.changed = changed;
    this.signal = signal;
    this.main = el("div", { class: "live-main", "data-testid": "main-settings" });
    this.body = el("div", { class: "live-form" });
    /** @type {import("./form.js").Form|null} */
    this.form = null;
  }

  /**
   * Build the form of an experiment, whose fields depend on its parts.
   *
   * `changes` are applied to the experiment that the server returns. If the fields stay the same,
   * the form is not replaced.
   */
  async build(requested, changes) {
    const request = (this.building = {});
    const submitted = structuredClone(requested);
    const { schema, experiment } = await postJSON(
      "api/schema",
      { experiment: submitted },
      this.signal,
    );
    if (request !== this.building) return;
    const shape = JSON.stringify(schema);
    if (changes || shape !== this.shape) {
      // The changes during the request.
      const currentChanges = changes ?? findChanges(this.form.value, submitted);
      this.shape = shape;
      const initial = applyChanges(experiment, currentChanges);
      this.replaceForm(
        createForm(
          schema,
          initial,
          () => this.changed(),
          (value) => this.build(value),
          isServerless() ? {} : CUSTOM_FIELDS,
        ),
      );
    }
    this.changed();
  }

  /** Replace the form. Open groups stay open, and the focus stays on its field. */
  replaceForm(form) {
    const openGroups = [...this.body.querySelectorAll("details[open]")];
    const open = new Set(openGroups.map((group) => group.getAttribute("data-testid")));
    const focused = document.activeElement?.id;
    this.form = form;
    this.body.replaceChildren(form.element);
    this.main.replaceChildren(...listMainFields(form));
    for (const group of this.body.querySelectorAll("details"))
      if (open.has(group.dataset.testid)) group.open = true;
    if (focused) document.getElementById(focused)?.focus();
  }
}

/** Return the elements of the main settings. They are moved out of their groups. */
function listMainFields(form) {
  return Object.entries(MAIN_SETTINGS).flatMap(([path, title]) => {
    const field = form.findField(path);
    if (field) field.querySelector("label, .form-name").textContent = title;
    return field ?? [];
  });
}

const EXAMPLE = '[{"generation": 20, "learning.rule": "none"}]';

/**
 * @param {Object<string, any>[]} schedule
 * @param {(schedule: any) => void} set called after each change
 */
function createScheduleField(schedule, set) {
  const input = el("textarea", {
    rows: 3,
    spellcheck: "false",
    placeholder: EXAMPLE,
    value: schedule.length ? JSON.stringify(schedule, null, 1) : "",
    "aria-label": `Changes during the run, for example ${EXAMPLE}`,
    "data-testid": "schedule",
    oninput: () => set(parse(input.value)),
  });
  return input;
}

/** Return the list of a text. The server rejects a text that is not JSON. */
function parse(text) {
  try {
    return JSON.parse(text.trim() || "[]");
  } catch {
    return text;
  }
}

/**
 * @typedef {{path: string, sha256?: string, share: number}} Founders
 */

/**
 * Return the rows of the founders.
 * @param {Founders[]} founders
 * @param {(founders: Founders[]) => void} set called after each change
 */
function createFoundersField(founders, set) {
  const root = el("div", { class: "form-groups" });
  let files = [];
  const change = (changed) => {
    founders = changed;
    set(founders);
    draw();
  };
  const draw = () => root.replaceChildren(...createRows(founders, files, change));
  draw();
  listFrozenFiles()
    .then((listed) => {
      files = listed.filter(({ problem }) => !problem);
      draw();
    })
    .catch((error) => showMessage(error.message, "error"));
  return root;
}

function createRows(founders, files, change) {
  const add = createButton(
    files.length ? "Add founders" : "The freezer is empty",
    () => change(shareEqually([...founders, { path: files[0].path, share: 1 }])),
    { class: "quiet", disabled: !files.length, "data-testid": "add-founders" },
  );
  return [...founders.map((_, row) => createRow(founders, row, files, change)), add];
}

/** Give all files the same share, because the shares must add up to 1. */
function shareEqually(founders) {
  return founders.map((entry) => ({ ...entry, share: 1 / founders.length }));
}

function createRow(founders, row, files, change) {
  const { path, share } = founders[row];
  const replace = (entry) => change(founders.map((old, index) => (index === row ? entry : old)));
  const options = files.map((file) => [file.path, `${file.name}: ${describeOrigin(file)}`]);
  // A run can have founders that are not in the freezer.
  if (!files.some((file) => file.path === path)) options.push([path, path]);
  const list = createSelect(options, path, (chosen) => replace({ path: chosen, share }), {
    "aria-label": `Founders ${row + 1}`,
    "data-testid": `founders-${row}`,
  });
  const shareInput = el("input", {
    type: "number",
    min: 0,
    max: 1,
    step: "any",
    value: share,
    "aria-label": `Share of founders ${row + 1}`,
    "data-testid": `share-${row}`,
    onchange: () => replace({ path, share: shareInput.valueAsNumber }),
  });
  const remove = createButton(
    "×",
    () => change(shareEqually(founders.filter((_, index) => index !== row))),
    { class: "quiet", "aria-label": `Remove founders ${row + 1}` },
  );
  return el("div", { class: "form-inputs founders-row" }, list, shareInput, remove);
}
