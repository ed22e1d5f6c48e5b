/** What a live run is to be: a preset, what is changed of it, how many runs, from which seed, how fast. */

import { el, getJSON, message, postJSON } from "./common.js";
import { schemaForm } from "./form.js";

const CHECK_AFTER = 200; // ms after the last change
const PACES = [["0", "as fast as it goes"], ["0.1", "10 a second"], ["0.5", "2 a second"], ["5", "one in 5 seconds"]]; // seconds a generation
const PACE = "0.1";

/**
 * @param {Object<string, string>} state of the address: preset, set (what is changed, JSON), runs, seed, pace
 * @param {(patch: Object<string, any>) => void} navigate
 * @param {object} hear
 * @param {(id: string) => void} hear.started a live run
 * @param {(seconds: number) => void} hear.paced the reader wants another pace, also of what runs already
 * @param {(experiment: Object<string, any>) => void} hear.valid what the form says, whenever it has changed and can be run
 * @param {AbortSignal} signal
 */
export async function setup(state, navigate, hear, signal) {
  const { presets, schema } = await getJSON("/api/presets", signal);
  const chosen = presets.some(({ name }) => name === state.preset) ? state.preset : "evo+self-taught/A";
  const given = { preset: chosen, runs: number(state.runs, 5), seed: number(state.seed, 0), pace: state.pace ?? PACE };
  const body = el("div", { class: "live-form" });
  const description = el("p", { class: "hint" });
  const fault = el("p", { class: "fault", hidden: true, "data-testid": "setup-fault" });
  const start = el("button", { type: "submit", class: "primary", "data-testid": "start" }, "Start");
  const check = checker(signal, start, hear.valid);
  let form = null;

  const load = async (name, changes) => {
    const base = await getJSON(`/api/preset?${new URLSearchParams({ name })}`, signal);
    description.textContent = presets.find((preset) => preset.name === name).description;
    form = schemaForm(schema, withChanges(base, changes), (value) => {
      const changed = changesOf(value, base);
      navigate({ set: Object.keys(changed).length ? JSON.stringify(changed) : null });
      reset.hidden = !Object.keys(changed).length;
      check(form);
    });
    reset.hidden = !Object.keys(changes).length;
    body.replaceChildren(form.element);
    check(form);
  };
  const reset = el("button", { type: "button", class: "quiet", hidden: true, "data-testid": "reset" }, "Undo all changes");
  reset.addEventListener("click", () => {
    navigate({ set: null });
    load(given.preset, {});
  });
  const preset = el("select", { "data-testid": "preset" }, ...presets.map(({ name }) => el("option", { value: name }, name)));
  preset.value = given.preset;
  preset.addEventListener("change", () => {
    given.preset = preset.value;
    navigate({ preset: preset.value, set: null });
    load(preset.value, {});
  });
  const remember = (name) => (value) => {
    given[name] = value;
    navigate({ [name]: value });
  };
  const element = el("form", { class: "card live-setup", novalidate: true, "aria-label": "What to run" },
    el("h1", {}, "Live run"),
    el("label", { class: "field" }, el("span", {}, "Preset"), preset, description),
    el("div", { class: "live-numbers" },
      counter("Runs", "runs", given.runs, 1, 50, remember("runs")),
      counter("Seed", "seed", given.seed, 0, 2 ** 31 - 1, remember("seed")),
      pacePicker(given.pace, (pace) => {
        remember("pace")(pace);
        hear.paced(Number(pace));
      })),
    el("div", { class: "row" }, el("h2", {}, "Parameters"), el("span", { class: "spread" }), reset), body, fault, start);
  element.addEventListener("submit", async (event) => {
    event.preventDefault();
    start.disabled = true;
    fault.hidden = true;
    try {
      const order = { experiment: form.value, runs: given.runs, seed: given.seed, seconds: Number(given.pace) };
      hear.started((await postJSON("/api/live", order, signal)).id);
    } catch (refusal) {
      if (refusal.name === "AbortError") return;
      fault.textContent = refusal.message;
      fault.hidden = false;
    } finally {
      start.disabled = false;
    }
  });
  await load(given.preset, parsed(state.set));
  return element;
}

/** Asks the server, soon after the last change, what is wrong with what the form says. */
function checker(signal, start, valid) {
  let waiting = 0;
  let turn = 0;
  return (form) => {
    clearTimeout(waiting);
    waiting = setTimeout(async () => {
      const mine = ++turn;
      const { errors } = await postJSON("/api/validate", { experiment: form.value }, signal);
      if (mine !== turn) return;
      form.show(errors);
      start.disabled = errors.length > 0;
      if (!errors.length) valid(form.value);
    }, CHECK_AFTER);
  };
}

function counter(title, name, value, min, max, changed) {
  const input = el("input", { type: "number", min, max, step: 1, value, "data-testid": `setup-${name}` });
  input.addEventListener("input", () => changed(input.value === "" ? "" : Number(input.value)));
  return el("label", { class: "field" }, el("span", {}, title), input);
}

/** How fast generations follow each other. */
function pacePicker(pace, changed) {
  const picker = el("select", { "data-testid": "pace" }, ...PACES.map(([value, name]) => el("option", { value }, name)));
  picker.value = pace;
  if (!picker.value) picker.value = PACE;
  picker.addEventListener("change", () => changed(picker.value));
  return el("label", { class: "field" }, el("span", {}, "Generations"), picker);
}

function number(text, otherwise) {
  return /^\d+$/.test(text ?? "") ? Number(text) : otherwise;
}

function parsed(text) {
  if (!text) return {};
  try {
    return JSON.parse(text);
  } catch {
    message("The changes in this address cannot be read; the preset is shown as it is.", "error");
    return {};
  }
}

/** The fields, by path, in which a tree differs from another; lists differ as a whole. */
function changesOf(tree, base, path = "") {
  if (tree === null || typeof tree !== "object" || Array.isArray(tree)) {
    return JSON.stringify(tree) === JSON.stringify(base) ? {} : { [path]: tree };
  }
  return Object.assign({}, ...Object.entries(tree).map(([key, value]) => changesOf(value, base[key], path ? `${path}.${key}` : key)));
}

/** A copy of a tree with the fields of `changes` set, by path; paths that it has not are passed over. */
function withChanges(base, changes) {
  const tree = structuredClone(base);
  for (const [path, value] of Object.entries(changes)) {
    const steps = path.split(".");
    const last = steps.pop();
    const holder = steps.reduce((below, step) => below?.[step], tree);
    if (holder && Object.hasOwn(holder, last)) holder[last] = value;
  }
  return tree;
}
