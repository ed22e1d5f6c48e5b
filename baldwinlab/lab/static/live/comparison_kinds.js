/** The two kinds of comparisons: presets, and values of one or two settings. */

import { createField, createSelect, el } from "../core/common.js";
import { formatName } from "./form_schema.js";
import { matchesWords } from "./setup_fields.js";

const MAX_FIELDS = 2;

/** The rows of the compared settings. */
export class ComparedValues {
  /**
   * @param {object} experiment of the form
   * @param {Object<string, any[]>} fields the initial values by path
   * @param {(path: string) => string[]} listOptions returns the options of a choice, or []
   */
  constructor(experiment, fields, listOptions) {
    const fieldValues = new Map(listFields(experiment).filter(([path]) => path !== "name"));
    this.rows = Array.from(
      { length: MAX_FIELDS },
      (_, number) =>
        createFieldRow(fieldValues, number, Object.entries(fields)[number], listOptions),
    );
    this.element = el(
      "div",
      { class: "compare-part" },
      el(
        "p",
        { class: "soft" },
        "The experiment of the form is simulated at each value, or at each pair of values of two " +
          "settings.",
      ),
      ...this.rows.map(({ element }) => element),
    );
  }

  /** Return the order of the server: the values of each chosen setting. */
  read() {
    const chosenRows = this.rows.filter(({ field }) => field.value);
    const entries = chosenRows.map(({ field, values }) => [field.value, parseValues(values.value)]);
    return { fields: Object.fromEntries(entries) };
  }

  get isComplete() {
    return Object.values(this.read().fields).some((values) => values.length > 1);
  }
}

/** Return the controls of a field and its values. */
function createFieldRow(fieldValues, number, initial, listOptions) {
  const title = number ? "Second setting (optional)" : "Setting";
  const field = createSelect(
    [
      ["", number ? "none" : "choose a setting"],
      ...[...fieldValues.keys()].map((path) => [path, formatPath(path)]),
    ],
    initial?.[0],
    () => changeField(),
    { "data-testid": `compare-field-${number}` },
  );
  const values = el("input", {
    spellcheck: "false",
    autocomplete: "off",
    "data-testid": `compare-values-${number}`,
  });
  if (field.value) values.value = formatValues(initial[1]);
  const valuesField = createField("Values, separated by commas", values);
  const ticks = el("fieldset", {
    class: "compare-ticks",
    "data-testid": `compare-ticks-${number}`,
  });
  // A choice has ticks instead of a text.
  const showInput = () => {
    const options = field.value ? listOptions(field.value) : [];
    ticks.hidden = !options.length;
    valuesField.hidden = !field.value || options.length > 0;
    ticks.replaceChildren(...createTicks(options, values));
  };
  showInput();
  const changeField = () => {
    values.value = field.value ? formatValues(proposeValues(fieldValues.get(field.value))) : "";
    showInput();
    field.dispatchEvent(new Event("input", { bubbles: true }));
  };
  return {
    field,
    values,
    element: el(
      "div",
      { class: "compare-field" },
      createField(title, field),
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
      oninput: () => (values.value = formatValues(
        inputs.filter(({ checked }) => checked).map((input) => input.value),
      )),
    })
  );
  return inputs.map((input) => el("label", { class: "inline" }, input, input.value));
}

/** Return all fields that can be compared, by path, with their values. */
function listFields(tree, path = "") {
  if (tree === null) return [];
  // A list of tables has fields, a list of numbers is a value.
  const hasFields = typeof tree === "object" &&
    (!Array.isArray(tree) || tree.some((item) => typeof item === "object"));
  if (!hasFields) return [[path, tree]];
  return Object.entries(tree).flatMap(([key, child]) =>
    listFields(child, path ? `${path}.${key}` : key)
  );
}

/** Return a path in words: "world.food.0.count" is "world, food 1, count". */
function formatPath(path) {
  const words = path.split(".").map((part) =>
    /^\d+$/.test(part) ? Number(part) + 1 : formatName(part)
  );
  return words.join(", ").replace(/, (\d+)/g, " $1");
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

/** The presets with ticks: the first choices in words, then all others. */
export class ComparedPresets {
  /**
   * @param {{name: string, paper?: string, description: string}[]} presets
   * @param {Object<string, string>} choices the first choices, in words, by preset
   * @param {string[]} ticked names that are ticked at first
   */
  constructor(presets, choices, ticked) {
    const first = presets.filter(({ name }) => name in choices);
    const others = presets.filter(({ name }) => !(name in choices));
    const createTicks = (members) =>
      members.map((preset) =>
        createTick(preset, choices[preset.name] ?? preset.description, ticked.includes(preset.name))
      );
    const choiceTicks = createTicks(first);
    this.others = createTicks(others);
    this.ticks = [...choiceTicks, ...this.others];
    this.groups = groupTicks(this.others);
    this.search = el("input", {
      type: "search",
      placeholder: `Search ${others.length} presets`,
      "aria-label": "Search presets to compare",
      "data-testid": "compare-search",
      oninput: () => this.filter(),
    });
    this.selection = el("p", { role: "status", "data-testid": "compare-selection" });
    this.element = el(
      "div",
      { class: "compare-part" },
      el("div", {}, ...choiceTicks.map(({ element }) => element)),
      el(
        "details",
        {
          class: "live-presets",
          open: !first.length || this.others.some(({ input }) => input.checked),
          "data-testid": "compare-all",
        },
        el("summary", {}, `${others.length} more presets`),
        this.search,
        el("div", { class: "compare-presets" }, ...this.groups.map(({ element }) => element)),
      ),
      this.selection,
    );
    this.element.addEventListener("input", () => this.showSelection());
    this.showSelection();
  }

  /** Show the presets that contain the words of the search, and all ticked ones. */
  filter() {
    const { value } = this.search;
    for (const { element, preset, input } of this.others)
      element.hidden = !input.checked && !matchesWords(preset, value);
    for (const { element, ticks } of this.groups) {
      element.hidden = ticks.every((tick) => tick.element.hidden);
      if (value) element.open = true;
    }
  }

  showSelection() {
    const titles = this.ticks.filter(({ input }) => input.checked).map(({ title }) => title);
    this.selection.textContent = titles.length ? `Ticked: ${titles.join("; ")}` : "";
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

/** Return a preset with a checkbox. Its title is in words, and its name is below. */
function createTick(preset, description, checked) {
  const { name } = preset;
  const title = description ? description[0].toUpperCase() + description.slice(1) : name;
  const input = el("input", { type: "checkbox", checked, value: name });
  const caption = description && el("small", {}, name);
  const element = el("label", { class: "compare-tick" }, input, el("span", {}, title, caption));
  return { preset, title, input, element };
}

/** Return a group of ticks for each paper. Groups with ticks are open. */
function groupTicks(ticks) {
  const groups = new Map();
  for (const tick of ticks) {
    const title = tick.preset.paper ?? "Presets";
    groups.set(title, [...(groups.get(title) ?? []), tick]);
  }
  return [...groups].map(([title, members]) => ({
    ticks: members,
    element: el(
      "details",
      { open: members.some(({ input }) => input.checked) },
      el("summary", {}, title),
      ...members.map(({ element }) => element),
    ),
  }));
}
