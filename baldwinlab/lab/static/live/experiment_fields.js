/** The fields of an experiment in the form of a live run: the main settings, and all parameters. */

import { el, isServerless, postJSON } from "../core/common.js";
import { applyChanges, findChanges } from "../core/experiment_changes.js";
import { createForm } from "./form.js";
import { createFoundersField } from "./founders_field.js";
import { createScheduleField } from "./schedule_field.js";

// Shown before all parameters.
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
    // The title of a field is complete only within its group.
    if (field) field.querySelector("label, .form-name").textContent = title;
    return field ?? [];
  });
}
