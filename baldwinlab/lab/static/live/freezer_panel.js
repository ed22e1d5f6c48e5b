/** The freezer: stored agents, which start a run or compete. */

import {
  createButton,
  createSelect,
  el,
  formatNumber,
  getJSON,
  openDialog,
  showMessage,
} from "../core/common.js";
import { createCompetition } from "./competition.js";

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
      : el("p", {}, "No agents are stored. Press the snowflake next to a map to keep its agents."),
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
