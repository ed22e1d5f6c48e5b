/** The freezer: stored agents, which start a run or compete. */

import {
  createButton,
  createOptions,
  createSelect,
  el,
  formatNumber,
  getJSON,
  openDialog,
  postJSON,
  showMessage,
} from "../core/common.js";
import { createNumberField } from "./setup_fields.js";

/**
 * @typedef {object} FrozenFile a genome file of /api/freezer
 * @property {string} name its path in the served folder
 * @property {string|null} problem why it cannot be read
 * @property {string} path that an experiment names
 * @property {string} condition
 * @property {number} generation
 * @property {number[]} runs
 * @property {number|null} agent
 * @property {number} n_agents
 * @property {string[]} conditions the presets whose agents have such genomes
 */

/** @returns {Promise<FrozenFile[]>} */
export async function listFrozenFiles(signal = undefined) {
  return (await getJSON("api/freezer", signal)).files;
}

/**
 * Return the button that opens the freezer.
 * @param {(preset: string, file: FrozenFile) => void} useFounders called to fill the form
 * @param {AbortSignal} signal closes the freezer
 */
export function createFreezerButton(useFounders, signal) {
  const open = () =>
    openFreezer(useFounders, signal).catch((error) => showMessage(error.message, "error"));
  return createButton("Freezer …", open, { "data-testid": "freezer" });
}

async function openFreezer(useFounders, signal) {
  const files = await listFrozenFiles(signal);
  const readable = files.filter(({ problem }) => !problem);
  const choose = (preset, file) => {
    dialog.close();
    useFounders(preset, file);
  };
  const dialog = el(
    "dialog",
    { class: "freezer", "aria-label": "Freezer" },
    el("h2", {}, "Freezer"),
    files.length
      ? el("ul", { class: "freezer-files" }, files.map((file) => createEntry(file, choose)))
      : el("p", {}, "No agents are stored. The menu Share next to a world keeps its agents."),
    ...(readable.length ? [createCompetition(readable)] : []),
    createButton("Close", () => dialog.close()),
  );
  signal.addEventListener("abort", () => dialog.close(), { once: true });
  openDialog(dialog);
}

/** Return a file with its origin, and a control that starts a run with its agents. */
function createEntry(file, useFounders) {
  if (file.problem) return el("li", {}, el("p", { class: "fault" }, file.problem));
  const conditions = file.conditions.length ? file.conditions : [file.condition];
  const options = conditions.map((name) => [name, name]);
  const preset = createSelect(options, file.condition, () => {}, {
    "aria-label": `Condition for ${file.name}`,
    "data-testid": "freezer-condition",
  });
  const start = createButton("Use as founders", () => useFounders(preset.value, file), {
    "aria-label": `Use ${file.name} as founders`,
    "data-testid": "use-founders",
  });
  return el(
    "li",
    { "data-testid": "frozen-file" },
    el("strong", {}, file.name),
    el("span", { class: "soft" }, describeOrigin(file)),
    el("div", { class: "row" }, preset, start),
  );
}

/** Return the origin of a file, for example "evo/A, generation 2, run 1, 20 agents". */
export function describeOrigin({ condition, generation, runs, agent, n_agents: agents }) {
  const runText = runs.length === 1 ? `run ${runs[0]}` : `${runs.length} runs`;
  const size = agent === null ? `${formatNumber(agents)} agents` : `agent ${agent}`;
  return `${condition}, generation ${generation}, ${runText}, ${size}`;
}

const INITIAL_LIVES = 20;
const MAX_LIVES = 200;
const OWN_CONDITION = "";

/**
 * Return a form that lets the agents of two files compete.
 * @param {FrozenFile[]} files
 */
function createCompetition(files) {
  let lives = INITIAL_LIVES;
  const names = files.map(({ name }) => [name, name]);
  const first = createSelect(names, files[0].name, () => listConditions(), {
    "aria-label": "First file",
    "data-testid": "compete-a",
  });
  const second = createSelect(names, files[1]?.name, () => {}, {
    "aria-label": "Second file",
    "data-testid": "compete-b",
  });
  const condition = el("select", { "aria-label": "Condition", "data-testid": "compete-condition" });
  const listConditions = () => {
    const { conditions } = files.find(({ name }) => name === first.value);
    condition.replaceChildren(...createOptions([
      [OWN_CONDITION, "in the condition of the first file"],
      ...conditions.map((name) => [name, `in ${name}`]),
    ]));
  };
  listConditions();
  const result = el("p", { role: "status", "data-testid": "competition" });
  const button = createButton("Compete", null, { type: "submit", "data-testid": "compete" });
  const form = el(
    "form",
    { class: "freezer-competition", "aria-label": "Competition" },
    el("h2", {}, "Let two files compete"),
    first,
    second,
    condition,
    createNumberField("Lives", "lives", lives, 1, MAX_LIVES, (value) => (lives = value)),
    button,
    result,
  );
  form.addEventListener("submit", async (event) => {
    event.preventDefault();
    button.disabled = true;
    result.textContent = "Simulating …";
    try {
      const order = { a: first.value, b: second.value, condition: condition.value, lives };
      result.textContent = describeCompetition(await postJSON("api/compete", order), order);
    } catch (error) {
      result.textContent = error.message;
    }
    button.disabled = false;
  });
  return form;
}

/** Return the result in two sentences. Without an interval, it is only the difference. */
function describeCompetition({ outcome, energy, difference, low, high, lives }, { a, b }) {
  const [meanA, meanB] = energy.map(formatNumber);
  const means = `Mean of ${outcome}: ${a} ${meanA}, ${b} ${meanB}.`;
  if (low === null) return `${means} Difference ${formatNumber(difference)}, one life.`;
  const interval = `${formatNumber(low)} to ${formatNumber(high)}`;
  const numbers = `difference ${
    formatNumber(difference)
  }, 95 % interval ${interval}, ${lives} lives`;
  if (low <= 0 && high >= 0) return `${means} Undecided: ${numbers}.`;
  return `${means} ${difference > 0 ? a : b} is higher: ${numbers}.`;
}
