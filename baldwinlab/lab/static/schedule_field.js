/** The schedule of a run in the form: rows of a generation, a setting and its new value. */

import { createButton, createSelect, el } from "./common.js";
import { resolve } from "./form_schema.js";

/**
 * @typedef {{generation: number, path: string, value: any}} Row
 * @typedef {{path: string, node: Object<string, any>, value: any}} Setting that can change
 */

// Settings that cannot change during a run, see `schedule.py`.
const FIXED = new RegExp(
  String.raw`^(name|model|population|record|schedule|network)(\.|$)|` +
    String.raw`^(evolution\.(generations|founders)|lifetime\.(steps|repeats))$`,
);

/**
 * Return the settings that can change during a run: numbers, switches and choices.
 * @param {Object<string, any>} schema
 * @param {Object<string, any>} experiment
 * @returns {Setting[]}
 */
export function listSettings(schema, experiment) {
  const form = { schema };
  const visit = (node, value, path) => {
    if (FIXED.test(path) || value === undefined || value === null) return [];
    if (node.properties)
      return Object.entries(node.properties).flatMap(([name, child]) =>
        visit(resolve(form, child), value[name], path ? `${path}.${name}` : name)
      );
    return node.enum || ["number", "integer", "boolean"].includes(node.type)
      ? [{ path, node, value }]
      : [];
  };
  return visit(schema, experiment, "");
}

/**
 * Return the rows of a schedule.
 * @param {Object<string, any>[]} schedule
 * @param {(schedule: Object<string, any>[]) => void} set called after each change
 * @param {Setting[]} settings
 */
export function createScheduleField(schedule, set, settings) {
  const root = el("div", { class: "form-groups" });
  const rows = splitChanges(schedule);
  const update = () => set(joinRows(rows));
  const redraw = () => {
    update();
    draw();
  };
  const add = () => {
    const { generation = 0 } = rows.at(-1) ?? {};
    const { path, value } = settings.find(({ path }) => path === "learning.rule") ?? settings[0];
    rows.push({ generation, path, value });
    redraw();
  };
  const remove = (index) => {
    rows.splice(index, 1);
    redraw();
  };
  const draw = () =>
    root.replaceChildren(
      ...rows.map((row, index) => {
        const element = createRow(row, index, settings, update, redraw);
        const attributes = { class: "quiet", "aria-label": `Remove change ${index + 1}` };
        element.append(createButton("×", () => remove(index), attributes));
        return element;
      }),
      createButton("Add a change", add, { class: "quiet", "data-testid": "add-schedule" }),
    );
  draw();
  return root;
}

/** Return one row per setting. @returns {Row[]} */
function splitChanges(schedule) {
  return schedule.flatMap(({ generation, ...settings }) =>
    Object.entries(settings).map(([path, value]) => ({ generation, path, value }))
  );
}

/** Return the schedule of rows, in the order of the generations. */
function joinRows(rows) {
  return rows
    .map(({ generation, path, value }) => ({ generation, [path]: value }))
    .sort((first, second) => first.generation - second.generation);
}

/** Return the inputs of a row, which they change. A new setting needs another input. */
function createRow(row, index, settings, update, redraw) {
  const generation = createNumber(row.generation, (value) => {
    row.generation = value;
    update();
  });
  setNames(generation, "Generation", "generation", index);
  const names = settings.map(({ path }) => path);
  if (!names.includes(row.path)) names.push(row.path);
  const path = createSelect(names.map((name) => [name, name]), row.path, (chosen) => {
    row.path = chosen;
    row.value = settings.find((setting) => setting.path === chosen)?.value;
    redraw();
  });
  setNames(path, "Setting", "path", index);
  const setting = settings.find((setting) => setting.path === row.path);
  const value = createValueInput(setting?.node ?? {}, row.value, (changed) => {
    row.value = changed;
    update();
  });
  setNames(value, "New value", "value", index);
  return el("div", { class: "form-inputs schedule-row" }, generation, path, value);
}

function setNames(input, label, testId, index) {
  input.setAttribute("aria-label", `${label} of change ${index + 1}`);
  input.setAttribute("data-testid", `schedule-${testId}-${index}`);
}

/** Return a list for a choice or a switch, else a number input. */
function createValueInput(node, value, changed) {
  const options = node.type === "boolean" ? [true, false] : node.enum;
  if (!options) return createNumber(value, changed);
  const pairs = options.map((option) => [option, String(option)]);
  const list = createSelect(pairs, value, () => changed(options[list.selectedIndex]));
  // An unknown value selects no option.
  list.value = String(value);
  return list;
}

function createNumber(value, changed) {
  const input = el("input", { type: "number", step: "any", value });
  input.addEventListener("input", () => changed(input.valueAsNumber));
  return input;
}
