/** The schedule of a run in the form: a list in JSON, which the server checks. */

import { el } from "../core/common.js";

const EXAMPLE = '[{"generation": 20, "learning.rule": "none"}]';

/**
 * @param {Object<string, any>[]} schedule
 * @param {(schedule: any) => void} set called after each change
 */
export function createScheduleField(schedule, set) {
  const input = el("textarea", {
    rows: 3,
    spellcheck: "false",
    placeholder: EXAMPLE,
    value: schedule.length ? JSON.stringify(schedule, null, 1) : "",
    "aria-label": `Changes during the run, for example ${EXAMPLE}`,
    "data-testid": "schedule",
    oninput: () => set(parse(input.value)),
  });
  return input;
}

/** Return the list of a text. The server rejects a text that is not JSON. */
function parse(text) {
  try {
    return JSON.parse(text.trim() || "[]");
  } catch {
    return text;
  }
}
