/** The inputs of a form: numbers with sliders, choices and texts. */

import { createSelect, el } from "../core/common.js";

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

export function createEntryInput(form, item, entries, number) {
  if (item.enum) return createChoice(form, item, entries, number);
  if (item.type === "string") return createTextInput(form, item, entries, number);
  return createNumberInput(form, item, entries, number);
}
