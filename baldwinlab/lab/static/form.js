/**
 * A form from a JSON schema: groups, numbers with sliders, choices and lists.
 *
 * The form does not depend on experiments. A field marked "x-chooses" determines other fields.
 * Values that the schema does not contain are shown as constants.
 */

import { el } from "./common.js";

/**
 * @typedef {object} Form
 * @property {HTMLElement} element
 * @property {Object<string, any>} value the current values
 * @property {(faults: {path: string, message: string}[]) => void} show shows each error at its
 *   field
 * @property {(path: string) => void} go scrolls to a field or its group
 *
 * @typedef {object} Place a field or a group
 * @property {HTMLElement|null} fault the element for errors; null: that of the enclosing group
 * @property {HTMLElement|null} input the input that is marked as invalid
 */

/**
 * @param {Object<string, any>} schema of an object, with its `$defs`
 * @param {Object<string, any>} start complete initial values; they determine the ranges of sliders
 * @param {(value: Object<string, any>) => void} onChange called after a change
 * @param {(value: Object<string, any>) => void} onChoose called instead if other fields depend on
 *   the change
 * @returns {Form}
 */
export function schemaForm(schema, start, onChange, onChoose) {
  const value = structuredClone(start);
  /** @type {Map<string, Place>} */
  const fields = new Map();
  const form = {
    schema,
    places: fields,
    changed: () => onChange(value),
    chosen: () => onChoose(value),
  };
  const fault = el("p", { class: "fault", hidden: true });
  fields.set("", { fault, input: null });
  const element = el("div", { class: "form" }, fault, ...fieldsOf(form, schema, value, ""));
  return {
    element,
    value,
    show: (faults) => showFaults(fields, faults),
    go: (path) => go(fields, path),
  };
}

function go(fields, path) {
  const [input, fault] = [fields.get(path)?.input, errorElement(fields, path)];
  open(fault);
  input?.focus({ preventScroll: true });
  (input ?? fault).scrollIntoView({ block: "center" });
}

/** Open all groups that contain an element. */
function open(element) {
  for (
    let group = element.closest("details");
    group;
    group = group.parentElement.closest("details")
  )
    group.open = true;
}

function showFaults(fields, faults) {
  for (const { fault, input } of fields.values()) {
    if (fault) fault.textContent = "";
    if (fault) fault.hidden = true;
    input?.removeAttribute("aria-invalid");
  }
  for (const { path, message } of faults) {
    const fault = errorElement(fields, path);
    fault.textContent += `${fault.textContent ? "\n" : ""}${message}`;
    fault.hidden = false;
    const input = fields.get(path)?.input;
    input?.setAttribute("aria-invalid", "true");
    if (input && input === document.activeElement) fault.scrollIntoView({ block: "nearest" });
    open(fault);
  }
}

/** Return the error element of a path: that of the field, or of the smallest enclosing group. */
function errorElement(fields, path) {
  for (
    let ancestor = path;
    ancestor;
    ancestor = ancestor.slice(0, Math.max(0, ancestor.lastIndexOf(".")))
  ) {
    const fault = fields.get(ancestor)?.fault;
    if (fault) return fault;
  }
  return fields.get("").fault;
}

export function resolve(form, node) {
  if (node.anyOf?.length === 2 && node.anyOf.some(({ type }) => type === "null")) {
    const { anyOf, ...rest } = node;
    return {
      ...resolve(
        form,
        anyOf.find(({ type }) => type !== "null"),
      ),
      ...rest,
      empty: true,
      // null if the input is empty.
    };
  }
  if (!node.$ref) return node;
  const { $ref, ...rest } = node;
  return { ...resolve(form, form.schema.$defs[$ref.split("/").pop()]), ...rest };
}

function fieldsOf(form, node, holder, path) {
  const at = (name) => (path ? `${path}.${name}` : name);
  const visible = Object.entries(node.properties ?? {}).filter(
    ([name]) => holder[name] !== undefined,
  );
  const unknown = Object.keys(holder).filter((name) => !(name in (node.properties ?? {})));
  return [
    ...visible.map(([name, below]) =>
      field(form, resolve(form, below), holder, name, at(name), below.title),
    ),
    ...unknown.map((name) => constantField(words(name), holder[name], at(name))),
  ];
}

/** Return a field that cannot be changed here. */
function constantField(title, value, path) {
  const text = typeof value === "string" ? value : JSON.stringify(value, null, 1);
  return el(
    "div",
    { class: "form-field", "data-testid": `plain-${path}` },
    el("span", { class: "form-name" }, title),
    el("pre", { class: "form-plain" }, text),
  );
}

/** Return the element of `holder[key]`, which it updates. A group can have its own title. */
function field(form, node, holder, key, path, title) {
  if (node.const !== undefined) return constantField(words(key), node.const, path);
  if (node.type === "object") return group(form, node, holder[key], path, title ?? words(key));
  if (node.type === "boolean")
    return labelledField(form, node, path, words(key), [checkbox(form, holder, key)]);
  if (node.enum)
    return labelledField(form, node, path, words(key), [choice(form, node, holder, key)]);
  if (node.prefixItems)
    return labelledField(
      form,
      node,
      path,
      words(key),
      numberPair(form, node, holder[key], path, words(key)),
    );
  if (node.type === "array" && node.items) return list(form, node, holder, key, path);
  if (node.type === "string")
    return labelledField(form, node, path, words(key), [text(form, node, holder, key)]);
  if (node.type !== "number" && node.type !== "integer")
    return constantField(words(key), holder[key], path);
  const number = numberInput(form, node, holder, key);
  const slider = sliderOf(form, node, holder, key, number, words(key));
  return labelledField(form, node, path, words(key), slider ? [slider, number] : [number]);
}

function group(form, node, value, path, title) {
  const fault = el("p", { class: "fault", hidden: true });
  form.places.set(path, { fault, input: null });
  const hint = node.description ? el("p", { class: "hint" }, node.description) : null;
  return el(
    "details",
    { class: "form-group", "data-testid": `group-${path}` },
    el("summary", {}, title),
    fault,
    hint,
    ...fieldsOf(form, node, value, path),
  );
}

/** Return a field: name, inputs, error and description. The last input is labeled. */
function labelledField(form, node, path, title, inputs) {
  const [input, id] = [inputs.at(-1), `field-${path}`];
  const [hint, fault] = [
    el("span", { class: "hint", id: `${id}-hint` }, node.description),
    el("p", { class: "fault", id: `${id}-fault`, hidden: true }),
  ];
  input.id = id;
  input.setAttribute("data-testid", id);
  input.setAttribute("aria-describedby", `${id}-hint ${id}-fault`);
  form.places.set(path, { fault, input });
  return el(
    "div",
    { class: "form-field" },
    el("label", { for: id }, title),
    el("div", { class: "form-inputs" }, ...inputs),
    fault,
    node.description ? hint : null,
  );
}

/** @returns {HTMLInputElement} */
function numberInput(form, node, holder, key) {
  const input = el("input", {
    type: "number",
    min: node.minimum ?? node.exclusiveMinimum ?? null,
    max: node.maximum ?? null,
    step: node.type === "integer" ? 1 : "any",
    value: holder[key],
    required: !node.empty,
  });
  const nothing = node.empty ? null : "";
  input.addEventListener("input", () =>
    set(form, holder, key, input.value === "" ? nothing : Number(input.value)),
  );
  return input;
}

/** Return a slider for a number with two limits. It covers at most four times the initial value. */
function sliderOf(form, node, holder, key, number, title) {
  const low = node.minimum ?? node.exclusiveMinimum;
  if (low === undefined || node.maximum === undefined || node.empty) return null;
  const [resolved, distance] = [node.type === "integer", holder[key] - low];
  const range = distance > 0 ? 4 * distance : resolved ? 20 : 1;
  const high = node.maximum - low <= 1 ? node.maximum : Math.min(node.maximum, low + range);
  const step = Math.max(resolved ? 1 : 0, 10 ** Math.floor(Math.log10((high - low) / 50)));
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
    set(form, holder, key, Number(number.value));
  });
  number.addEventListener("input", () => (slider.value = number.value));
  return slider;
}

function checkbox(form, holder, key) {
  const input = el("input", { type: "checkbox", checked: holder[key] });
  input.addEventListener("change", () => set(form, holder, key, input.checked));
  return input;
}

function choice(form, node, holder, key) {
  const input = el(
    "select",
    {},
    ...node.enum.map((option) => el("option", { value: option }, option)),
  );
  input.value = holder[key];
  input.addEventListener("change", () => {
    holder[key] = input.value;
    node["x-chooses"] ? form.chosen() : form.changed();
  });
  return input;
}

function text(form, node, holder, key) {
  const input = el("input", {
    type: "text",
    maxlength: node.maxLength ?? null,
    spellcheck: "false",
    value: holder[key],
  });
  input.addEventListener("input", () => set(form, holder, key, input.value));
  return input;
}

/** Return a fixed number of inputs in a row. */
function numberPair(form, node, values, path, title) {
  return node.prefixItems.map((item, number) => {
    const input = numberInput(form, resolve(form, item), values, number);
    input.setAttribute("aria-label", `${title}, ${number === 0 ? "from" : "to"}`);
    form.places.set(`${path}.${number}`, { fault: null, input });
    return input;
  });
}

/** Return a list that can grow and shrink: numbers in a row, or groups. */
function list(form, node, holder, key, path) {
  const [item, title] = [resolve(form, node.items), words(key)];
  const [fault, entries] = [
    el("p", { class: "fault", hidden: true }),
    el("div", { class: item.type === "object" ? "form-groups" : "form-row" }),
  ];
  const add = el(
    "button",
    { type: "button", class: "quiet", "data-testid": `add-${path}` },
    item.type === "object" ? `Add a ${words(item.title)}` : "Add",
  );
  const draw = () => {
    for (const old of [...form.places.keys()])
      if (old.startsWith(`${path}.`)) form.places.delete(old);
    entries.replaceChildren(
      ...holder[key].map((_, number) =>
        entry(form, item, holder, key, number, path, title, redraw),
      ),
    );
    add.disabled = node.maxItems !== undefined && holder[key].length >= node.maxItems;
  };
  const redraw = (values) => {
    holder[key] = values;
    draw();
    item["x-chooses"] ? form.chosen() : form.changed();
  };
  // There are no options.
  add.hidden = item.enum?.length === 0;
  add.addEventListener("click", () => redraw([...holder[key], newEntry(form, item, holder[key])]));
  form.places.set(path, { fault, input: null });
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

function entry(form, item, holder, key, number, path, title, redraw) {
  const entryLabel = `${title} ${number + 1}`;
  const remove = el(
    "button",
    {
      type: "button",
      class: "quiet",
      "aria-label": `Remove ${entryLabel}`,
      "data-testid": `remove-${path}.${number}`,
    },
    item.type === "object" ? `Remove ${entryLabel}` : "×",
  );
  remove.addEventListener("click", () =>
    redraw(holder[key].filter((_, other) => other !== number)),
  );
  if (item.type === "object") {
    const entryGroup = group(form, item, holder[key][number], `${path}.${number}`, entryLabel);
    entryGroup.open = true;
    entryGroup.append(remove);
    return entryGroup;
  }
  const make = item.enum ? choice : item.type === "string" ? text : numberInput;
  const input = make(form, item, holder[key], number);
  input.setAttribute("aria-label", entryLabel);
  input.setAttribute("data-testid", `field-${path}.${number}`);
  form.places.set(`${path}.${number}`, { fault: null, input });
  return el("span", { class: "form-entry" }, input, remove);
}

/**
 * Return the initial value of a new entry: an unused option, a copy of the last entry, or a
 * default.
 */
function newEntry(form, item, entries) {
  if (item.enum) return item.enum.find((option) => !entries.includes(option)) ?? item.enum[0];
  return structuredClone(entries.at(-1)) ?? defaultValue(form, item);
}

/** Return the default value of a field, or a value within its limits. */
function defaultValue(form, node) {
  const resolved = resolve(form, node);
  if (resolved.default !== undefined) return structuredClone(resolved.default);
  if (resolved.type === "object")
    return Object.fromEntries(
      Object.entries(resolved.properties).map(([name, below]) => [name, defaultValue(form, below)]),
    );
  if (resolved.prefixItems) return resolved.prefixItems.map((_, number) => 100 * number);
  return resolved.minimum ?? 0;
}

function set(form, holder, key, value) {
  holder[key] = value;
  form.changed();
}

/** Return `FoodRegion` and `food_region` as "food region". */
function words(name) {
  return name
    .replace(/_/g, " ")
    .replace(/([a-z])([A-Z])/g, "$1 $2")
    .toLowerCase();
}
