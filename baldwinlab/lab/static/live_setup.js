/** The settings of a live run: preset, changed parameters, number of runs, seed and speed. */

import { el, getJSON, message, postJSON, isServerless } from "./common.js";
import { schemaForm } from "./form.js";
import { sweepDialog } from "./sweep_dialog.js";

// Milliseconds after the last change.
const CHECK_AFTER = 200;
const PACES = [
  ["0", "maximum"],
  ["0.1", "10 per second"],
  ["0.5", "2 per second"],
  ["5", "1 per 5 seconds"],
  // Seconds per generation.
];
const PACE = "0.1";

/**
 * @typedef {object} Listener
 * @property {(id: string) => void} started called after a live run started
 * @property {(name: string) => void} swept called after a sweep started, with the name of its study
 * @property {(seconds: number) => void} paced called when the user changes the speed
 * @property {(shown: {world: object, appearance: object}) => void} valid called with the world of a valid
 *   experiment
 */
export class Setup {
  /**
   * @param {Object<string, string>} state of the address: preset, set (changes, JSON), runs, seed,
   *   pace, fields (of a planned sweep, JSON)
   * @param {(patch: Object<string, any>) => void} navigate
   * @param {Listener} listener
   * @param {AbortSignal} signal
   */
  constructor(state, navigate, listener, signal) {
    Object.assign(this, { state, navigate, listener, signal });
    this.given = {
      runs: parseNumber(state.runs, 5),
      seed: parseNumber(state.seed, 0),
      pace: state.pace ?? PACE,
    };
    this.body = el("div", { class: "live-form" });
    this.description = el("p", { class: "hint" });
    // Why the run cannot start.
    this.fault = el("p", { class: "fault", role: "status", "data-testid": "setup-fault" });
    this.note = el("p", {
      class: "hint",
      role: "status",
      hidden: true,
      "data-testid": "setup-note",
      // A note about too few runs.
    });
    this.start = el(
      "button",
      { type: "submit", class: "primary", "data-testid": "start" },
      "Start",
    );
    this.sweep = el(
      "button",
      {
        type: "button",
        "data-testid": "sweep",
        hidden: isServerless(),
        onclick: () => this.plan({}),
      },
      "Sweep a field …",
    );
    this.reset = el(
      "button",
      { type: "button", class: "quiet", hidden: true, "data-testid": "reset" },
      "Undo all changes",
    );
    this.waiting = this.turn = 0;
  }

  /** Load the presets and fill `root`. */
  async show(root) {
    this.root = root;
    const { presets, default: usual } = await getJSON("/api/presets", this.signal);
    this.presets = presets;
    const { preset } = this.state;
    this.preset = el("select", { "data-testid": "preset" }, ...groupPresets(presets));
    this.preset.value = presets.some(({ name }) => name === preset) ? preset : usual;
    this.preset.addEventListener("change", () => this.resetToPreset());
    this.reset.addEventListener("click", () => this.resetToPreset());
    await this.load(parseChanges(this.state.set));
    root.replaceChildren(this.element());
    if (this.state.fields && !isServerless()) this.plan(parseChanges(this.state.fields));
  }

  /** Open the dialog of a sweep. */
  plan(fields) {
    const { runs, seed } = this.given;
    const remember = (chosen) => this.navigate({ fields: chosen && JSON.stringify(chosen) });
    const dialog = sweepDialog(
      { preset: this.preset.value, experiment: this.form.value, runs, seed },
      fields,
      remember,
      (name) => this.listener.swept(name),
    );
    this.signal.addEventListener("abort", () => dialog.close(), { once: true });
  }

  /** Load the settings of a run into the form, to change it and start it again. */
  async editRun({ experiment, runs, seed, seconds }) {
    const name = this.presets.some((preset) => preset.name === experiment.name)
      ? experiment.name
      : this.preset.value;
    this.preset.value = name;
    this.given = { runs, seed, pace: String(seconds) };
    this.navigate({ preset: name, ...this.given });
    const base = await getJSON(`/api/preset?${new URLSearchParams({ name })}`, this.signal);
    await this.load(changesOf(experiment, base));
    this.root.replaceChildren(this.element());
    this.heading.focus();
    this.heading.scrollIntoView({ block: "nearest" });
  }

  element() {
    const { given, body, fault, start } = this;
    const remember = (name) => (value) => {
      given[name] = value;
      this.navigate({ [name]: value });
      if (name === "pace") this.listener.paced(Number(value));
      else this.check();
    };
    this.heading = el("h1", { tabindex: -1 }, "Live run");
    const element = el(
      "form",
      { class: "card live-setup", novalidate: true, "aria-label": "Settings of the live run" },
      this.heading,
      el("div", { class: "row live-begin" }, start, this.sweep),
      fault,
      el("label", { class: "field" }, el("span", {}, "Preset"), this.preset, this.description),
      el(
        "div",
        { class: "live-numbers" },
        numberField("Runs", "runs", given.runs, 1, 50, remember("runs")),
        numberField("Seed", "seed", given.seed, 0, 2 ** 31 - 1, remember("seed")),
        pacePicker(given.pace, remember("pace")),
      ),
      this.note,
      el(
        "div",
        { class: "row" },
        el("h2", {}, "Parameters"),
        el("span", { class: "spread" }),
        this.reset,
      ),
      body,
    );
    element.addEventListener("submit", (event) => {
      event.preventDefault();
      this.begin();
    });
    return element;
  }

  /** Load the selected preset without changes. */
  resetToPreset() {
    this.navigate({ preset: this.preset.value, set: null });
    return this.load({});
  }

  async load(changes) {
    const name = this.preset.value;
    this.base = await getJSON(`/api/preset?${new URLSearchParams({ name })}`, this.signal);
    this.description.textContent = this.presets.find((preset) => preset.name === name).description;
    await this.build(applyChanges(this.base, changes), changes);
  }

  /**
   * Build the form of an experiment, whose fields depend on its parts.
   *
   * `changes` are applied to the experiment that the server returns. If the fields stay the same,
   * the form is not replaced.
   */
  async build(experimentWanted, changes) {
    const request = (this.building = {});
    const submitted = structuredClone(experimentWanted);
    const { schema, experiment } = await postJSON(
      "/api/schema",
      { experiment: submitted },
      this.signal,
    );
    if (request !== this.building) return;
    const shape = JSON.stringify(schema);
    if (changes || shape !== this.shape) {
      // The changes during the request.
      const changesNow = changes ?? changesOf(this.form.value, submitted);
      this.shape = shape;
      this.replace(
        schemaForm(
          schema,
          applyChanges(experiment, changesNow),
          () => this.changed(),
          (value) => this.build(value),
        ),
      );
    }
    this.changed();
  }

  /** Replace the form. Open groups stay open, and the focus stays on its field. */
  replace(form) {
    const open = new Set(
      [...this.body.querySelectorAll("details[open]")].map((group) => group.dataset.testid),
    );
    const focused = document.activeElement?.id;
    this.form = form;
    this.body.replaceChildren(form.element);
    for (const group of this.body.querySelectorAll("details"))
      if (open.has(group.dataset.testid)) group.open = true;
    if (focused) document.getElementById(focused)?.focus();
  }

  /** Write the changes to the address, and validate the experiment. */
  changed() {
    const changes = changesOf(this.form.value, this.base);
    this.reset.hidden = !Object.keys(changes).length;
    this.navigate({ set: this.reset.hidden ? null : JSON.stringify(changes) });
    this.check();
  }

  /** Validate the experiment soon after the last change. */
  check() {
    clearTimeout(this.waiting);
    const request = ++this.turn;
    this.waiting = setTimeout(async () => {
      // A copy, because the user can change the form during the request.
      const [form, order] = [this.form, structuredClone(this.order())];
      const { errors, note } = await postJSON("/api/validate", order, this.signal);
      if (request !== this.turn) return;
      form.show(errors.filter(({ path }) => !(path in this.given)));
      for (const name of ["runs", "seed"])
        this.root.querySelector(`#setup-${name}`)?.setAttribute(
          "aria-invalid",
          errors.some(({ path }) => path === name),
        );
      this.start.disabled = errors.length > 0;
      this.explain(errors);
      this.note.textContent = note ?? "";
      this.note.hidden = !note;
      if (errors.length) return;
      const shown = await postJSON("/api/appearance", { experiment: order.experiment }, this.signal);
      if (request === this.turn) this.listener.valid(shown);
    }, CHECK_AFTER);
  }

  order() {
    const { runs, seed, pace } = this.given;
    return { experiment: this.form.value, runs, seed, seconds: Number(pace) };
  }

  /** Show next to the button why the run cannot start, with a button to the field. */
  explain(errors) {
    const [first, ...rest] = errors;
    const more = rest.length ? ` Further errors: ${rest.length}.` : "";
    const showButton = el(
      "button",
      {
        type: "button",
        class: "quiet",
        "data-testid": "setup-show",
        onclick: () => this.form.go(first.path),
      },
      "Show the field",
    );
    this.fault.replaceChildren(
      ...(first ? [`${first.message}.${more} `] : []),
      ...(first?.path && !(first.path in this.given) ? [showButton] : []),
    );
  }

  async begin() {
    this.start.disabled = true;
    try {
      this.listener.started((await postJSON("/api/live", this.order(), this.signal)).id);
    } catch (refusal) {
      if (refusal.name === "AbortError") return;
      this.explain([{ path: "", message: refusal.message }]);
    } finally {
      this.start.disabled = false;
    }
  }
}

function numberField(title, name, value, min, max, changed) {
  const id = `setup-${name}`;
  const input = el("input", { type: "number", min, max, step: 1, value, id, "data-testid": id });
  input.addEventListener("input", () => changed(input.value === "" ? "" : Number(input.value)));
  return el("label", { class: "field" }, el("span", {}, title), input);
}

/** Return the control for the speed of generations. */
function pacePicker(pace, changed) {
  const picker = el(
    "select",
    { "data-testid": "pace" },
    ...PACES.map(([value, name]) => el("option", { value }, name)),
  );
  picker.value = pace;
  if (!picker.value) picker.value = PACE;
  picker.addEventListener("change", () => changed(picker.value));
  return el("label", { class: "field", title: "Generations" }, el("span", {}, "Speed"), picker);
}

function parseNumber(text, fallback) {
  return /^\d+$/.test(text ?? "") ? Number(text) : fallback;
}

function parseChanges(text) {
  if (!text) return {};
  try {
    return JSON.parse(text);
  } catch {
    message(
      "The changes in this address cannot be read. The form shows the unchanged preset.",
      "error",
    );
    return {};
  }
}

/** Return the changed fields by path. A list is one field. */
export function changesOf(tree, base, path = "") {
  if (tree === null || typeof tree !== "object" || Array.isArray(tree)) {
    return JSON.stringify(tree) === JSON.stringify(base) ? {} : { [path]: tree };
  }
  return Object.assign(
    {},
    ...Object.entries(tree).map(([key, value]) =>
      changesOf(value, base?.[key], path ? `${path}.${key}` : key),
    ),
  );
}

/** Return a copy of a tree with changed fields. Unknown paths are ignored. */
export function applyChanges(base, changes) {
  const tree = structuredClone(base);
  for (const [path, value] of Object.entries(changes)) {
    const steps = path.split(".");
    const last = steps.pop();
    const holder = steps.reduce((below, step) => below?.[step], tree);
    if (holder && Object.hasOwn(holder, last)) holder[last] = value;
  }
  return tree;
}

/** Return the options of the presets, grouped by learner. */
function groupPresets(presets) {
  const groups = new Map();
  for (const { name, learner } of presets)
    groups.set(learner, [...(groups.get(learner) ?? []), el("option", { value: name }, name)]);
  return [...groups].flatMap(([learner, options]) =>
    learner && options.length > 1 ? [el("optgroup", { label: learner }, ...options)] : options,
  );
}
