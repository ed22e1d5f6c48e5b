/** The schedule of a run in the form, as text. The server checks it, as all fields. */

import { el } from "./common.js";

const EXAMPLE = "50 learning.rule=none";

/**
 * Return a text field with one line for each generation at which settings change.
 * @param {Object<string, any>[]} schedule
 * @param {(schedule: Object<string, any>[]) => void} set called after each change
 */
export function createScheduleField(schedule, set) {
  const text = el("textarea", {
    class: "schedule",
    rows: Math.max(2, schedule.length),
    spellcheck: "false",
    placeholder: EXAMPLE,
    title: `One line for each generation, for example ${EXAMPLE}`,
    "aria-label": "Schedule: one line for each generation",
    "data-testid": "schedule",
  });
  text.value = schedule.map(formatChange).join("\n");
  text.addEventListener("input", () => set(parseSchedule(text.value)));
  return text;
}

/** Return a change as `50 learning.rule=none learning.rate=0.2`, as in the option --schedule. */
function formatChange({ generation, ...settings }) {
  const assignments = Object.entries(settings).map(([path, value]) =>
    `${path}=${typeof value === "string" ? value : JSON.stringify(value)}`
  );
  return [generation, ...assignments].join(" ");
}

/** Return the schedule of a text. A word that is no value of JSON is a text. */
function parseSchedule(text) {
  return text.split("\n").filter((line) => line.trim()).map((line) => {
    const [generation, ...assignments] = line.trim().split(/\s+/);
    const settings = assignments.map((assignment) => {
      const [path, ...value] = assignment.split("=");
      return [path, parseValue(value.join("="))];
    });
    return { generation: parseValue(generation), ...Object.fromEntries(settings) };
  });
}

/** Return a number, a switch or a list, or the text of another word. */
function parseValue(word) {
  try {
    return JSON.parse(word);
  } catch {
    return word;
  }
}
