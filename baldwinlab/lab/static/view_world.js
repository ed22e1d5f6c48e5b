/** The World tab: worlds, or alleles and views for models without a world. */

import { showMessage } from "./common.js";
import { PRESETS, chooseOpening, hasWorld, loadStudies } from "./sources.js";
import { ModelTab } from "./model_tab.js";
import { WorldTab } from "./world_tab.js";

export function mount(root, state, navigate, guide) {
  let requested = state;
  let available = null;
  let tab = null;
  let closed = false;
  const update = (state) => {
    requested = state;
    if (!available) return;
    const Tab = hasWorld(available.studies, state) ? WorldTab : ModelTab;
    if (tab instanceof Tab) return tab.show(state);
    if (tab) closeTab();
    tab = new Tab(root, navigate, guide, available);
    tab.start(state);
  };
  const closeTab = () => {
    tab.close();
    guide.setTexts("");
    root.className = "view-world";
    root.replaceChildren(guide.root);
  };
  const begin = async () => {
    const { studies, worldless, problems } = await loadStudies();
    for (const problem of problems) showMessage(problem, "error");
    if (closed) return;
    const why = worldless.length
      ? "The models of the stored studies have no world to show."
      : "This folder contains no study yet.";
    if (studies[0].id === PRESETS)
      showMessage(`${why} The lab simulates built-in presets instead.`);
    available = { studies, worldless };
    const { guide: shownText, ...rest } = requested;
    update(Object.keys(rest).length ? requested : { ...requested, ...chooseOpening(studies) });
  };
  begin();
  return {
    update,
    unmount() {
      closed = true;
      tab?.close();
    },
  };
}
