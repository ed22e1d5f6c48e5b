/** The button that stores an agent or a population in the freezer. */

import { createIconButton, isServerless, postJSON, showMessage } from "../core/common.js";
import { openSaveDialog } from "../core/save_dialog.js";
import { createLifetimeQuery } from "../core/sources.js";

// A snowflake.
const ICON = "M10 2v16M3 6l14 8M17 6L3 14M8 3.5l2 2 2-2M8 16.5l2-2 2 2";

/**
 * Return a button, or null on a page without a server.
 * @param {string} label for example "Keep this agent"
 * @param {string} testId
 * @param {() => {source: import("../core/sources.js").Source, agent?: number|null}} getTarget the
 *   lifetime, and the agent or the complete population
 */
export function createFreezerButton(label, testId, getTarget) {
  if (isServerless()) return null;
  return createIconButton(label, ICON, () => storeAgents(getTarget()), { "data-testid": testId });
}

function storeAgents({ source, agent = null }) {
  const { live, condition = `live-${live}`, run, generation } = source;
  const suffix = agent === null ? "" : `-agent-${agent}`;
  const name = `${condition}-generation-${generation}-run-${run}${suffix}`;
  openSaveDialog(
    agent === null ? "Keep this population" : `Keep agent ${agent}`,
    "Name of the file in the freezer",
    name.replace(/[^A-Za-z0-9+_-]+/g, "-"),
    async (chosen) => {
      const life = Object.fromEntries(createLifetimeQuery(source));
      const file = await postJSON("api/freezer", { life, agent, name: chosen });
      showMessage(`Stored as ${file.name}. The freezer is in the tab Live run.`, "done");
    },
  );
}
