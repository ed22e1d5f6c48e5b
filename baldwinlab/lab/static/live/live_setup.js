/** The settings of a live run: preset, changed parameters, number of runs, seed and speed. */

import { getCurrentView } from "../core/address.js";
import { createButton, el, getJSON, isServerless, postJSON } from "../core/common.js";
import { CompareDialog } from "./comparison_dialog.js";
import { applyChanges, findChanges, parseChanges } from "../core/experiment_changes.js";
import { ExperimentFields } from "./experiment_fields.js";
import {
  createNumberField,
  createSpeedPicker,
  DEFAULT_SPEED,
  PresetPicker,
} from "./setup_fields.js";
import { parseWholeNumber } from "./live_selector.js";

// Milliseconds after the last change.
const VALIDATION_DELAY = 200;
// Runs of each condition of a comparison, if the user has set no number. They usually decide.
const COMPARED_RUNS = 10;

/**
 * @typedef {object} Listener
 * @property {(id: string) => void} started called after a live run started
 * @property {(name: string) => void} compared called after a comparison started, with the name of
 *   its study
 * @property {(seconds: number) => void} paced called when the user changes the speed
 * @property {(preview: {world: object, appearance: object}) => void} valid called with the world
 *   of a valid experiment
 */
export class Setup {
  /**
   * @param {Object<string, string>} state of the address: preset, set (changes, JSON), runs, seed,
   *   pace, compare (a planned comparison, JSON)
   * @param {(patch: Object<string, any>) => void} navigate
   * @param {Listener} listener
   * @param {AbortSignal} signal
   */
  constructor(state, navigate, listener, signal) {
    this.state = state;
    this.navigate = navigate;
    this.listener = listener;
    this.signal = signal;
    this.numbers = {
      runs: parseWholeNumber(state.runs) ?? 5,
      seed: parseWholeNumber(state.seed) ?? 0,
      pace: state.pace ?? DEFAULT_SPEED,
    };
    this.fields = new ExperimentFields(() => this.changed(), signal);
    // Why the run cannot start.
    this.fault = el("p", { class: "fault", role: "status", "data-testid": "setup-fault" });
    // About too few runs.
    this.note = el("p", {
      class: "hint",
      role: "status",
      hidden: true,
      "data-testid": "setup-note",
    });
    // Disabled until the settings are valid.
    this.start = createButton("Start", null, {
      type: "submit",
      class: "primary",
      disabled: true,
      "data-testid": "start",
    });
    this.compare = createButton("Compare …", () => this.openCompareDialog({}), {
      hidden: isServerless(),
      "data-testid": "compare-open",
    });
    this.begin = el("div", { class: "row live-begin" }, this.start, this.compare);
    // The view places a menu here.
    this.corner = el("span", {});
    this.reset = createButton("Undo all changes", () => this.resetToPreset(), {
      class: "quiet",
      hidden: true,
      "data-testid": "reset",
    });
    this.validationTimer = 0;
    this.latestRequest = 0;
  }

  /** Load the presets and fill `root`. */
  async show(root) {
    this.root = root;
    const { presets, choices = {}, default: defaultPreset } = await getJSON(
      "api/presets",
      this.signal,
    );
    const { preset } = this.state;
    this.choices = choices;
    this.preset = new PresetPicker(presets, choices, () => this.resetToPreset());
    this.preset.value = this.preset.has(preset) ? preset : defaultPreset;
    await this.load(parseChanges(this.state.set));
    root.replaceChildren(this.createElement());
    const { compare } = this.state;
    if (compare && !isServerless()) this.openCompareDialog(parseChanges(compare));
  }

  /** Open the dialog of a comparison. */
  openCompareDialog(compared) {
    const { seed } = this.numbers;
    const runs = parseWholeNumber(getCurrentView().state.runs) ?? COMPARED_RUNS;
    const { presets } = this.preset;
    const listOptions = (path) =>
      [...(this.fields.form.findField(path)?.querySelector("select")?.options ?? [])].map(
        ({ value }) => value,
      );
    const order = { preset: this.preset.value, experiment: this.fields.form.value, runs, seed };
    const remember = (compared) => this.navigate({ compare: compared && JSON.stringify(compared) });
    const { element } = new CompareDialog(
      { order, presets, choices: this.choices, listOptions },
      compared,
      remember,
      (name) => this.listener.compared(name),
    );
    this.signal.addEventListener("abort", () => element.close(), { once: true });
  }

  /** Load a preset with changes into the form. */
  async loadPreset(name, changes) {
    this.preset.value = name;
    this.navigate({ preset: name });
    await this.load(changes);
    this.root.replaceChildren(this.createElement());
    this.heading.focus();
    this.heading.scrollIntoView({ block: "nearest" });
  }

  /** Load the settings of a run into the form, to change it and start it again. */
  async editRun({ experiment, runs, seed, seconds }) {
    const name = this.preset.has(experiment.name) ? experiment.name : this.preset.value;
    this.numbers = { runs, seed, pace: String(seconds) };
    this.navigate(this.numbers);
    const base = await getJSON(`api/preset?${new URLSearchParams({ name })}`, this.signal);
    await this.loadPreset(name, findChanges(experiment, base));
  }

  /** Change the experiment of the form, for example by a drag on the map. */
  async edit(change) {
    const experiment = structuredClone(this.fields.form.value);
    change(experiment);
    await this.fields.build(experiment, {});
  }

  createElement() {
    const { numbers, fault } = this;
    const remember = (name) => (value) => {
      numbers[name] = value;
      this.navigate({ [name]: value });
      if (name === "pace") this.listener.paced(Number(value));
      else this.validateSoon();
    };
    this.heading = el("h1", { tabindex: -1 }, "Live run");
    const element = el(
      "form",
      {
        class: "card live-setup",
        novalidate: true,
        "aria-label": "Settings of the live run",
      },
      el("div", { class: "row" }, this.heading, el("span", { class: "spread" }), this.corner),
      this.begin,
      fault,
      ...this.preset.elements,
      el(
        "div",
        { class: "live-numbers" },
        createNumberField("Runs", "runs", numbers.runs, 1, 50, remember("runs")),
        createNumberField("Seed", "seed", numbers.seed, 0, 2 ** 31 - 1, remember("seed")),
        createSpeedPicker(numbers.pace, remember("pace")),
      ),
      this.note,
      this.fields.main,
      el(
        "div",
        { class: "row" },
        el("h2", {}, "All settings"),
        el("span", { class: "spread" }),
        this.reset,
      ),
      this.fields.body,
    );
    element.addEventListener("submit", (event) => {
      event.preventDefault();
      this.startRun();
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
    this.base = await getJSON(`api/preset?${new URLSearchParams({ name })}`, this.signal);
    await this.fields.build(applyChanges(this.base, changes), changes);
  }

  /** Write the changes to the address, and validate the experiment. */
  changed() {
    const changes = findChanges(this.fields.form.value, this.base);
    this.reset.hidden = !Object.keys(changes).length;
    this.navigate({ set: this.reset.hidden ? null : JSON.stringify(changes) });
    this.validateSoon();
  }

  /** Validate the experiment soon after the last change. */
  validateSoon() {
    clearTimeout(this.validationTimer);
    const request = ++this.latestRequest;
    this.validationTimer = setTimeout(async () => {
      // A copy, because the user can change the form during the request.
      const form = this.fields.form;
      const order = structuredClone(this.createOrder());
      const { errors, note } = await postJSON("api/validate", order, this.signal);
      if (request !== this.latestRequest) return;
      form.show(errors.filter(({ path }) => !(path in this.numbers)));
      for (const name of ["runs", "seed"])
        this.root.querySelector(`#setup-${name}`)?.setAttribute(
          "aria-invalid",
          errors.some(({ path }) => path === name),
        );
      this.start.disabled = errors.length > 0;
      this.showErrors(errors);
      this.note.textContent = note ?? "";
      this.note.hidden = !note;
      if (errors.length) return;
      const preview = await postJSON(
        "api/appearance",
        { experiment: order.experiment },
        this.signal,
      );
      if (request === this.latestRequest) this.listener.valid(preview);
    }, VALIDATION_DELAY);
  }

  createOrder() {
    const { runs, seed, pace } = this.numbers;
    return { experiment: this.fields.form.value, runs, seed, seconds: Number(pace) };
  }

  /** Show next to the button why the run cannot start, with a button to the field. */
  showErrors(errors) {
    const [first, ...rest] = errors;
    const restText = rest.length ? ` Further errors: ${rest.length}.` : "";
    const showField = () => this.fields.form.scrollTo(first.path);
    const showButton = createButton("Show the field", showField, {
      class: "quiet",
      "data-testid": "setup-show",
    });
    this.fault.replaceChildren(
      ...(first ? [`${first.message}.${restText} `] : []),
      ...(first?.path && !(first.path in this.numbers) ? [showButton] : []),
    );
  }

  async startRun() {
    this.start.disabled = true;
    try {
      this.listener.started((await postJSON("api/live", this.createOrder(), this.signal)).id);
    } catch (error) {
      if (error.name === "AbortError") return;
      this.showErrors([{ path: "", message: error.message }]);
    } finally {
      this.start.disabled = false;
    }
  }
}
