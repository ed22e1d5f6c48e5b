/** The World tab: worlds, or alleles and views for models without a world. */

import { el, showMessage } from "../core/common.js";
import { ModelTab } from "./model_tab.js";
import {
  addTypicalRun,
  chooseOpening,
  findNearestLifetime,
  formatLifetimeAddress,
  hasWorld,
  loadStudies,
  MissingLifetimeError,
  PRESETS,
  requireViewable,
} from "../core/sources.js";
import { WorldTab } from "./world_tab.js";
import { readSecondLifetime } from "./world_address.js";

export function mount(root, state, navigate, guide) {
  let requested = state;
  let available = null;
  let tab = null;
  let closed = false;
  const update = async (state) => {
    requested = state;
    if (!available) return;
    try {
      requireLifetimes(available, state);
    } catch (error) {
      if (!(error instanceof MissingLifetimeError)) throw error;
      closeTab();
      // No picture, because it would be the picture of another lifetime.
      root.append(createMissingNotice(error));
      return;
    }
    // Without a run, the tab shows the typical one.
    const completeState = await addTypicalRun(available.studies, state);
    // The user has moved on.
    if (requested !== state || closed) return;
    const Tab = hasWorld(available.studies, state) ? WorldTab : ModelTab;
    if (tab instanceof Tab) return tab.show(completeState);
    closeTab();
    tab = new Tab(root, navigate, guide, available);
    tab.start(completeState);
  };
  const closeTab = () => {
    tab?.close();
    tab = null;
    guide.setTexts("");
    root.className = "view-world";
    root.replaceChildren(guide.root);
  };
  const begin = async () => {
    const { studies, worldless, unplayable } = await loadStudies();
    if (closed) return;
    if (unplayable.length) showMessage(describeUnplayable(unplayable));
    const why = worldless.length
      ? "The models of the stored studies have no world to show."
      : unplayable.length
      ? "No stored study can be played."
      : "This folder contains no study yet.";
    if (studies[0].id === PRESETS)
      showMessage(`${why} The lab simulates built-in presets instead.`);
    available = { studies, worldless, unplayable };
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

/** Name the studies that cannot be played. Their notices have the reasons. */
function describeUnplayable(unplayable) {
  const names = unplayable.map(({ study }) => study).join(", ");
  return `Not playable: ${names}. Choose a study in Results to see why.`;
}

/**
 * Throw MissingLifetimeError if the address names lifetimes that cannot be shown.
 * @param {import("../core/sources.js").Stored} stored
 * @param {Object<string, string>} state
 */
function requireLifetimes(stored, state) {
  requireViewable(stored, state);
  const first = findNearestLifetime(stored.studies, state, true);
  const second = readSecondLifetime(state, first);
  if (second) findNearestLifetime(stored.studies, second, true);
}

/**
 * Return a message with links to lifetimes that exist.
 * @param {import("../core/sources.js").MissingLifetimeError} error
 */
function createMissingNotice({ message, choices }) {
  const links = choices.map(({ label, life }) =>
    el("li", {}, el("a", { href: formatLifetimeAddress(life) }, label))
  );
  return el(
    "section",
    { class: "empty", role: "alert", "data-testid": "missing-lifetime" },
    el("h1", {}, message),
    el("p", {}, links.length ? "Available here:" : ""),
    el("ul", {}, ...links),
  );
}
