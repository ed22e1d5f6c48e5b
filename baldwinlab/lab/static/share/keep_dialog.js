/** The dialog that stores an agent or a population in the freezer. */

import { postJSON, showMessage } from "../core/common.js";
import { openSaveDialog } from "../core/save_dialog.js";
import { createLifetimeQuery } from "../core/sources.js";

/**
 * Ask for the name of the file, and store the agents.
 * @param {import("../core/sources.js").Source} source
 * @param {number|null} [agent] null for the complete population
 */
export function openKeepDialog(source, agent = null) {
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
