/** The list of presets with a search and a description. */

import { createField, el } from "../core/common.js";
import { groupPresets, matchesWords } from "./setup_fields.js";

// Fewer presets need no search.
const MIN_SEARCHED = 20;

export class PresetPicker {
  /**
   * @param {{name: string, paper?: string, description: string}[]} presets
   * @param {() => void} chosen called when the user chooses a preset
   */
  constructor(presets, chosen) {
    this.presets = presets;
    this.list = el("select", { "data-testid": "preset", onchange: chosen }, groupPresets(presets));
    this.description = el("p", { class: "hint" });
    this.search = el("input", {
      type: "search",
      placeholder: `Search ${presets.length} presets`,
      "aria-label": "Search presets",
      "data-testid": "preset-search",
      hidden: presets.length < MIN_SEARCHED,
      oninput: () => this.filter(),
    });
    this.list.addEventListener("change", () => this.describe());
  }

  get elements() {
    const { list, description, search } = this;
    return [createField("Preset", list, description), search];
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
