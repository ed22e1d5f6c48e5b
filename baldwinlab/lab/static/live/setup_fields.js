/** The fields of a live run that are not parameters: preset, runs, seed and speed. */

import { createField, createSelect, el } from "../core/common.js";

// Seconds per generation.
const SPEEDS = [
  ["0", "maximum"],
  ["0.1", "10 per second"],
  ["0.5", "2 per second"],
  ["5", "1 per 5 seconds"],
];

// Letters of a caption in the list of presets.
const MAX_CAPTION = 60;

export const DEFAULT_SPEED = "0.1";

export function createNumberField(title, name, value, min, max, changed) {
  const id = `setup-${name}`;
  const input = el("input", { type: "number", min, max, step: 1, value, id, "data-testid": id });
  input.addEventListener("input", () => changed(input.value === "" ? "" : Number(input.value)));
  return createField(title, input);
}

/** Return the control for the speed of generations. */
export function createSpeedPicker(pace, changed) {
  const isKnown = SPEEDS.some(([seconds]) => seconds === pace);
  const picker = createSelect(SPEEDS, isKnown ? pace : DEFAULT_SPEED, changed, {
    "data-testid": "pace",
  });
  const field = createField("Speed", picker);
  field.title = "Generations";
  return field;
}

/** Return the options of the presets with captions, grouped by paper. */
function groupPresets(presets) {
  const groups = new Map();
  for (const { name, paper, description } of presets) {
    const caption = description ? `${name}: ${shorten(description)}` : name;
    const option = el("option", { value: name, title: description }, caption);
    groups.set(paper, [...(groups.get(paper) ?? []), option]);
  }
  return [...groups].flatMap(([paper, options]) =>
    paper ? [el("optgroup", { label: paper }, ...options)] : options
  );
}

/** Return whether the name, paper or description of a preset contains all words of a search. */
export function matchesWords({ name, paper = "", description }, search) {
  const text = `${name} ${paper} ${description}`.toLowerCase();
  return search
    .toLowerCase()
    .split(/\s+/)
    .every((word) => text.includes(word));
}

function shorten(text) {
  return text.length > MAX_CAPTION ? `${text.slice(0, MAX_CAPTION).trimEnd()} …` : text;
}

// Fewer presets need no search.
const MIN_SEARCHED = 20;

export class PresetPicker {
  /**
   * @param {{name: string, paper?: string, description: string}[]} presets
   * @param {Object<string, string>} choices the first choices, in words, by preset
   * @param {() => void} chosen called when the user chooses a preset
   */
  constructor(presets, choices, chosen) {
    this.presets = presets;
    this.list = el("select", { "data-testid": "preset", onchange: chosen }, groupPresets(presets));
    this.description = el("p", { class: "hint" });
    this.search = el("input", {
      type: "search",
      placeholder: `Search ${presets.length} presets`,
      "aria-label": "Search presets",
      "data-testid": "preset-search",
      hidden: this.hasFew,
      oninput: () => this.filter(),
    });
    this.list.addEventListener("change", () => this.describe());
    this.choices = Object.entries(choices)
      .map(([name, title]) => this.createChoice(name, title, chosen));
    this.all = el(
      "details",
      { class: "live-presets", "data-testid": "all-presets", open: this.hasFew },
      el("summary", {}, `All ${presets.length} presets`),
      createField("Preset", this.list, this.description),
      this.search,
    );
  }

  /** Whether the list is short, as on most exported pages. */
  get hasFew() {
    return this.presets.length < MIN_SEARCHED;
  }

  createChoice(name, title, chosen) {
    const choose = () => {
      this.value = name;
      chosen();
    };
    const input = el("input", { type: "radio", name: "preset", value: name, onchange: choose });
    return el("label", { class: "inline" }, input, title);
  }

  get elements() {
    if (this.hasFew) return [this.all];
    const legend = el("legend", { class: "visually-hidden" }, "What to simulate");
    return [el("fieldset", { class: "live-choices" }, legend, ...this.choices), this.all];
  }

  has(name) {
    return this.presets.some((preset) => preset.name === name);
  }

  get value() {
    return this.list.value;
  }

  set value(name) {
    this.list.value = name;
    // The search has removed it from the list.
    if (!this.list.value) this.list.replaceChildren(...groupPresets(this.presets));
    this.list.value = name;
    this.describe();
  }

  describe() {
    const preset = this.presets.find(({ name }) => name === this.value);
    this.description.textContent = preset?.description ?? "";
    const radios = this.choices.map((choice) => choice.querySelector("input"));
    for (const radio of radios) radio.checked = radio.value === this.value;
    // A preset without a choice in words is shown in the list.
    if (!radios.some(({ checked }) => checked)) this.all.open = true;
  }

  /** List the presets whose name, paper or description contains the words of the search. */
  filter() {
    const { value } = this;
    const matches = this.presets.filter(
      (preset) => preset.name === value || matchesWords(preset, this.search.value),
    );
    this.list.replaceChildren(...groupPresets(matches));
    this.list.value = value;
  }
}
