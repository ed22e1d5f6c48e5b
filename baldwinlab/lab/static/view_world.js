/** The World tab: worlds or, of a model whose lives have none, its alleles and views. */

import { message } from "./common.js";
import { PRESETS, hasWorld, loadStudies } from "./sources.js";
import { ModelTab } from "./model_tab.js";
import { WorldTab } from "./world_tab.js";

export function mount(root, state, navigate, guide) {
  let [asked, there, shown, closed] = [state, null, null, false];
  const update = (state) => {
    asked = state;
    if (!there) return;
    const Tab = hasWorld(there.studies, state) ? WorldTab : ModelTab;
    if (shown instanceof Tab) return shown.come(state);
    if (shown) leave();
    shown = new Tab(root, navigate, guide, there);
    shown.start(state);
  };
  const leave = () => {
    shown.close();
    guide.tell([]);
    root.className = "view-world";
    root.replaceChildren(guide.root);
  };
  const begin = async () => {
    const { studies, worldless, problems } = await loadStudies();
    for (const problem of problems) message(problem, "error");
    if (closed) return;
    const why = worldless.length
      ? "The models of the stored studies have no world to show."
      : "This folder contains no study yet.";
    if (studies[0].id === PRESETS)
      message(`${why} The lab simulates built-in presets instead.`);
    there = { studies, worldless };
    update(asked);
  };
  begin();
  return {
    update,
    unmount() {
      closed = true;
      shown?.close();
    },
  };
}
