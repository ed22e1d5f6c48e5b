/** The inputs of a form: numbers with sliders, choices, texts and lists. */

import { createButton, createSelect, el } from "../core/common.js";
import { chooseNewEntry, formatName, resolve } from "./form_schema.js";

/** @returns {HTMLInputElement} */
export function createNumberInput(form, node, holder, key) {
  const input = el("input", {
    type: "number",
    min: node.minimum ?? node.exclusiveMinimum ?? null,
    max: node.maximum ?? null,
    step: node.type === "integer" ? 1 : "any",
    value: holder[key],
    required: !node.empty,
  });
  const emptyValue = node.empty ? null : "";
  input.addEventListener(
    "input",
    () => setValue(form, holder, key, input.value === "" ? emptyValue : Number(input.value)),
  );
  return input;
}

/** Return a slider for a number with two limits. It covers at most four times the initial value. */
export function createSlider(form, node, holder, key, number, title) {
  const low = node.minimum ?? node.exclusiveMinimum;
  if (low === undefined || node.maximum === undefined || node.empty) return null;
  const isInteger = node.type === "integer";
  const distance = holder[key] - low;
  const defaultRange = isInteger ? 20 : 1;
  const range = distance > 0 ? 4 * distance : defaultRange;
  const high = node.maximum - low <= 1 ? node.maximum : Math.min(node.maximum, low + range);
  const step = Math.max(isInteger ? 1 : 0, 10 ** Math.floor(Math.log10((high - low) / 50)));
  const first = node.minimum === undefined ? low + step : low;
  const slider = el("input", {
    type: "range",
    min: first,
    max: high,
    step,
    "aria-label": `${title}, slider`,
  });
  slider.value = String(holder[key]);
  slider.addEventListener("input", () => {
    number.value = String(Number(Number(slider.value).toPrecision(6)));
    setValue(form, holder, key, Number(number.value));
  });
  number.addEventListener("input", () => (slider.value = number.value));
  return slider;
}

export function createCheckbox(form, holder, key) {
  const input = el("input", { type: "checkbox", checked: holder[key] });
  input.addEventListener("change", () => setValue(form, holder, key, input.checked));
  return input;
}

export function createChoice(form, node, holder, key) {
  const options = node.enum.map((option) => [option, option]);
  const input = createSelect(options, holder[key], (value) => {
    holder[key] = value;
    if (node["x-chooses"]) form.chosen();
    else form.changed();
  });
  // An unknown value selects no option.
  input.value = holder[key];
  return input;
}

export function createTextInput(form, node, holder, key) {
  const input = el("input", {
    type: "text",
    maxlength: node.maxLength ?? null,
    spellcheck: "false",
    value: holder[key],
  });
  input.addEventListener("input", () => setValue(form, holder, key, input.value));
  return input;
}

function setValue(form, holder, key, value) {
  holder[key] = value;
  form.changed();
}

function createEntryInput(form, item, entries, number) {
  if (item.enum) return createChoice(form, item, entries, number);
  if (item.type === "string") return createTextInput(form, item, entries, number);
  return createNumberInput(form, item, entries, number);
}

/** Return a list that can grow and shrink: numbers in a row, or groups. */
export function createList(form, node, holder, key, path) {
  const item = resolve(form, node.items);
  // A list that is not set is null, and stays null while it has no entries.
  const emptyList = holder[key] === null ? null : [];
  const listed = () => holder[key] ?? [];
  const title = formatName(key);
  const fault = el("p", { class: "fault", hidden: true });
  const entries = el("div", { class: item.type === "object" ? "form-groups" : "form-row" });
  const add = createButton(
    item.type === "object" ? `Add a ${formatName(item.title)}` : "Add",
    () => redraw([...listed(), chooseNewEntry(form, item, listed())]),
    // There can be no options.
    { class: "quiet", hidden: item.enum?.length === 0, "data-testid": `add-${path}` },
  );
  const draw = () => {
    for (const old of [...form.fields.keys()])
      if (old.startsWith(`${path}.`)) form.fields.delete(old);
    entries.replaceChildren(
      ...listed().map((_, number) =>
        createEntry(form, item, holder, key, number, path, title, redraw)
      ),
    );
    add.disabled = node.maxItems !== undefined && listed().length >= node.maxItems;
  };
  const redraw = (values) => {
    holder[key] = values.length > 0 ? values : emptyList;
    draw();
    if (item["x-chooses"]) form.chosen();
    else form.changed();
  };
  form.fields.set(path, { fault, input: null });
  draw();
  return el(
    "div",
    { class: "form-field", role: "group", "aria-label": title, "data-testid": `list-${path}` },
    el("span", { class: "form-name" }, title),
    node.description ? el("span", { class: "hint" }, node.description) : null,
    entries,
    add,
    fault,
  );
}

function createEntry(form, item, holder, key, number, path, title, redraw) {
  const entryLabel = `${title} ${number + 1}`;
  const remove = createButton(
    item.type === "object" ? `Remove ${entryLabel}` : "×",
    () => redraw(holder[key].filter((_, index) => index !== number)),
    {
      class: "quiet",
      "aria-label": `Remove ${entryLabel}`,
      "data-testid": `remove-${path}.${number}`,
    },
  );
  if (item.type === "object") {
    const entryGroup = form.createGroup(
      form,
      item,
      holder[key][number],
      `${path}.${number}`,
      entryLabel,
    );
    entryGroup.open = true;
    entryGroup.append(remove);
    return entryGroup;
  }
  const input = createEntryInput(form, item, holder[key], number);
  input.setAttribute("aria-label", entryLabel);
  input.setAttribute("data-testid", `field-${path}.${number}`);
  form.fields.set(`${path}.${number}`, { fault: null, input });
  return el("span", { class: "form-entry" }, input, remove);
}
