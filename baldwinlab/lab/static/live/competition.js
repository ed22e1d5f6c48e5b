/** The competition of two files of the freezer. */

import {
  createButton,
  createOptions,
  createSelect,
  el,
  formatNumber,
  postJSON,
} from "../core/common.js";
import { createNumberField } from "./setup_fields.js";

const INITIAL_LIVES = 20;
const MAX_LIVES = 200;
const OWN_CONDITION = "";

/**
 * Return a form that lets the agents of two files compete.
 * @param {import("./freezer_panel.js").FrozenFile[]} files
 */
export function createCompetition(files) {
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
