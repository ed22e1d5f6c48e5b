/** The World tab: worlds, or alleles and views for models without a world. */

import { el, showMessage } from "./common.js";
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
    const { study } = state;
    const isKnown = ({ id, study: name = id }) => name === study;
    if (study && ![...available.studies, ...available.worldless].some(isKnown))
      return showUnknownStudy(study);
    const Tab = hasWorld(available.studies, state) ? WorldTab : ModelTab;
    if (tab instanceof Tab) return tab.show(state);
    closeTab();
    tab = new Tab(root, navigate, guide, available);
    tab.start(state);
  };
  /** Show no picture of another study. */
  const showUnknownStudy = (name) => {
    closeTab();
    const links = available.studies.map(({ id }) =>
      el("li", {}, el("a", { href: `#/world?${new URLSearchParams({ study: id })}` }, id)),
    );
    root.append(
      el(
        "div",
        { class: "empty", "data-testid": "unknown-study" },
        el("h1", {}, `There is no readable study ${name} in this folder`),
        el("ul", {}, ...links),
      ),
    );
  };
  const closeTab = () => {
    tab?.close();
    tab = null;
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
    const { guide: _guide, ...rest } = requested;
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
