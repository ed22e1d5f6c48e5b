/**
 * A form from a JSON schema: groups, numbers with sliders, choices and lists.
 *
 * The form does not depend on experiments. A field marked "x-chooses" determines other fields.
 * Values that the schema does not contain are shown as constants.
 */

import { el } from "../core/common.js";
import {
  createCheckbox,
  createChoice,
  createList,
  createNumberInput,
  createSlider,
  createTextInput,
} from "./form_inputs.js";
import { describeSetting, formatName, resolve } from "./form_schema.js";

/**
 * @typedef {object} Form
 * @property {HTMLElement} element
 * @property {Object<string, any>} value the current values
 * @property {(path: string) => HTMLElement|undefined} findField returns the element of a field
 * @property {(errors: {path: string, message: string}[]) => void} show shows each error at its
 *   field
 * @property {(path: string) => void} scrollTo scrolls to a field or its group
 *
 * @typedef {object} FieldElements a field or a group
 * @property {HTMLElement|null} fault the element for errors; null: that of the enclosing group
 * @property {HTMLElement|null} input the input that is marked as invalid
 */

/**
 * @param {Object<string, any>} schema of an object, with its `$defs`
 * @param {Object<string, any>} start complete initial values; they determine the ranges of sliders
 * @param {(value: Object<string, any>) => void} onChange called after a change
 * @param {(value: Object<string, any>) => void} onChoose called instead if other fields depend on
 *   the change
 * @param {Object<string, (value: any, set: (value: any) => void) => HTMLElement>} [custom] the
 *   inputs of fields with their own controls, by path
 * @returns {Form}
 */
export function createForm(schema, start, onChange, onChoose, custom = {}) {
  const value = structuredClone(start);
  /** @type {Map<string, FieldElements>} */
  const fields = new Map();
  const form = {
    schema,
    fields,
    custom,
    createGroup,
    changed: () => onChange(value),
    chosen: () => onChoose(value),
  };
  const fault = el("p", { class: "fault", hidden: true });
  fields.set("", { fault, input: null });
  const element = el("div", { class: "form" }, fault, ...createFields(form, schema, value, ""));
  return {
    element,
    value,
    findField: (path) => fields.get(path)?.input?.closest(".form-field"),
    show: (errors) => showErrors(fields, errors),
    scrollTo: (path) => scrollToField(fields, path),
  };
}

function scrollToField(fields, path) {
  const input = fields.get(path)?.input;
  const errorElement = findErrorElement(fields, path);
  openGroups(errorElement);
  input?.focus({ preventScroll: true });
  (input ?? errorElement).scrollIntoView({ block: "center" });
}

/** Open all groups that contain an element. */
function openGroups(element) {
  for (
    let group = element.closest("details");
    group;
    group = group.parentElement.closest("details")
  )
    group.open = true;
}

function showErrors(fields, errors) {
  for (const { fault, input } of fields.values()) {
    if (fault) fault.textContent = "";
    if (fault) fault.hidden = true;
    input?.removeAttribute("aria-invalid");
  }
  for (const { path, message } of errors) {
    const errorElement = findErrorElement(fields, path);
    errorElement.textContent += `${errorElement.textContent ? "\n" : ""}${message}`;
    errorElement.hidden = false;
    const input = fields.get(path)?.input;
    input?.setAttribute("aria-invalid", "true");
    if (input && input === document.activeElement)
      errorElement.scrollIntoView({ block: "nearest" });
    openGroups(errorElement);
  }
}

/** Return the error element of a path: that of the field, or of the smallest enclosing group. */
function findErrorElement(fields, path) {
  for (
    let ancestor = path;
    ancestor;
    ancestor = ancestor.slice(0, Math.max(0, ancestor.lastIndexOf(".")))
  ) {
    const errorElement = fields.get(ancestor)?.fault;
    if (errorElement) return errorElement;
  }
  return fields.get("").fault;
}

function createFields(form, node, holder, path) {
  const at = (name) => (path ? `${path}.${name}` : name);
  const visible = Object.entries(node.properties ?? {}).filter(
    ([name]) => holder[name] !== undefined,
  );
  // The tables of an experiment are before its name and model, which few users change.
  const isTable = ([, child]) => resolve(form, child).type === "object";
  if (!path) visible.sort((first, second) => Number(isTable(second)) - Number(isTable(first)));
  const unknown = Object.keys(holder).filter((name) => !(name in (node.properties ?? {})));
  return [
    ...visible.map(([name, child]) =>
      createField(form, resolve(form, child), holder, name, at(name), child.title)
    ),
    ...unknown.map((name) => createConstantField(formatName(name), holder[name], at(name))),
  ];
}

/** Return a field that cannot be changed here. */
function createConstantField(title, value, path) {
  const text = typeof value === "string" ? value : JSON.stringify(value, null, 1);
  return el(
    "div",
    { class: "form-field", "data-testid": `plain-${path}` },
    el("span", { class: "form-name" }, title),
    el("pre", { class: "form-plain" }, text),
  );
}

/** Return the element of `holder[key]`, which it updates. A group can have its own title. */
function createField(form, node, holder, key, path, title) {
  if (form.custom[path]) return createCustomField(form, node, holder, key, path);
  const { name, hint } = describeSetting(key, node.description);
  if (node.const !== undefined) return createConstantField(name, node.const, path);
  if (node.type === "object")
    return createGroup(form, node, holder[key], path, title ?? formatName(key));
  if (!node.enum && !node.prefixItems && node.type === "array" && node.items)
    return createList(form, node, holder, key, path);
  const inputs = createInputs(form, node, holder, key, path, name);
  return inputs
    ? createLabeledField(form, path, name, hint, inputs)
    : createConstantField(name, holder[key], path);
}

/** Return the inputs of a field, or null for an unknown type. */
function createInputs(form, node, holder, key, path, name) {
  if (node.type === "boolean") return [createCheckbox(form, holder, key)];
  if (node.enum) return [createChoice(form, node, holder, key)];
  if (node.prefixItems)
    return createNumberInputs(form, node, holder[key], path, name);
  if (node.type === "string") return [createTextInput(form, node, holder, key)];
  if (node.type !== "number" && node.type !== "integer") return null;
  const number = createNumberInput(form, node, holder, key);
  const slider = createSlider(form, node, holder, key, number, name);
  return slider ? [slider, number] : [number];
}

/** Return a field whose inputs another module creates. */
function createCustomField(form, node, holder, key, path) {
  const title = formatName(key);
  const fault = el("p", { class: "fault", hidden: true });
  form.fields.set(path, { fault, input: null });
  const inputs = form.custom[path](holder[key], (value) => {
    holder[key] = value;
    form.changed();
  });
  return el(
    "div",
    { class: "form-field", role: "group", "aria-label": title, "data-testid": `custom-${path}` },
    el("span", { class: "form-name" }, title),
    el("span", { class: "hint" }, node.description),
    inputs,
    fault,
  );
}

function createGroup(form, node, value, path, title) {
  const fault = el("p", { class: "fault", hidden: true });
  form.fields.set(path, { fault, input: null });
  const hint = node.description ? el("p", { class: "hint" }, node.description) : null;
  return el(
    "details",
    { class: "form-group", "data-testid": `group-${path}` },
    el("summary", { title: path }, title),
    fault,
    hint,
    ...createFields(form, node, value, path),
  );
}

/** Return a field: name, inputs, error and hint. The last input is labeled. */
function createLabeledField(form, path, name, text, inputs) {
  const input = inputs.at(-1);
  const id = `field-${path}`;
  const hint = el("span", { class: "hint", id: `${id}-hint` }, text);
  const fault = el("p", { class: "fault", id: `${id}-fault`, hidden: true });
  input.id = id;
  input.setAttribute("data-testid", id);
  input.setAttribute("aria-describedby", `${id}-hint ${id}-fault`);
  form.fields.set(path, { fault, input });
  return el(
    "div",
    { class: "form-field" },
    el("label", { for: id, title: path }, name),
    el("div", { class: "form-inputs" }, ...inputs),
    fault,
    hint,
  );
}

/** Return a fixed number of inputs in a row. */
function createNumberInputs(form, node, values, path, title) {
  return node.prefixItems.map((item, number) => {
    const input = createNumberInput(form, resolve(form, item), values, number);
    input.setAttribute("aria-label", `${title}, ${number === 0 ? "from" : "to"}`);
    form.fields.set(`${path}.${number}`, { fault: null, input });
    return input;
  });
}
