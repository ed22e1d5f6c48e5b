/** The presets that a comparison uses: ticks, grouped by paper, with a search. */

import { el } from "../core/common.js";
import { matchesWords } from "./setup_fields.js";

/** The list of presets with ticks. */
export class ComparedPresets {
  /**
   * @param {{name: string, paper?: string, description: string}[]} presets
   * @param {string[]} ticked names that are ticked at first
   */
  constructor(presets, ticked) {
    this.ticks = presets.map((preset) => createTick(preset, ticked.includes(preset.name)));
    this.groups = groupTicks(this.ticks);
    this.search = el("input", {
      type: "search",
      placeholder: `Search ${presets.length} presets`,
      "aria-label": "Search presets to compare",
      "data-testid": "compare-search",
      oninput: () => this.filter(),
    });
    this.selection = el("p", { role: "status", "data-testid": "compare-selection" });
    this.element = el(
      "div",
      { class: "compare-part" },
      this.search,
      el("div", { class: "compare-presets" }, ...this.groups.map(({ element }) => element)),
      this.selection,
    );
    this.element.addEventListener("input", () => this.showSelection());
    this.showSelection();
  }

  /** Show the presets that contain the words of the search, and all ticked ones. */
  filter() {
    const { value } = this.search;
    for (const { element, preset, input } of this.ticks)
      element.hidden = !input.checked && !matchesWords(preset, value);
    for (const { element, ticks } of this.groups) {
      element.hidden = ticks.every((tick) => tick.element.hidden);
      if (value) element.open = true;
    }
  }

  showSelection() {
    const { presets } = this.read();
    this.selection.textContent = presets.length ? `Ticked: ${presets.join(", ")}` : "";
  }

  /** Return the order of the server: the names of the ticked presets. */
  read() {
    const ticked = this.ticks.filter(({ input }) => input.checked);
    return { presets: ticked.map(({ preset }) => preset.name) };
  }

  get isComplete() {
    return this.read().presets.length > 1;
  }
}

function createTick(preset, checked) {
  const input = el("input", { type: "checkbox", checked, value: preset.name });
  const caption = preset.description && el("small", {}, preset.description);
  const element = el(
    "label",
    { class: "compare-tick" },
    input,
    el("span", {}, preset.name, caption),
  );
  return { preset, input, element };
}

/** Return a group of ticks for each paper. The first group and groups with ticks are open. */
function groupTicks(ticks) {
  const groups = new Map();
  for (const tick of ticks) {
    const title = tick.preset.paper ?? "Presets";
    groups.set(title, [...(groups.get(title) ?? []), tick]);
  }
  return [...groups].map(([title, members], number) => ({
    ticks: members,
    element: el(
      "details",
      { open: number === 0 || members.some(({ input }) => input.checked) },
      el("summary", {}, title),
      ...members.map(({ element }) => element),
    ),
  }));
}
