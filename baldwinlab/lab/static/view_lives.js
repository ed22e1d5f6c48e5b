/** The World tab: worlds or, of a model whose lives have none, its alleles and views. */

import { message } from "./common.js";
import { PRESETS, hasWorld, watchable } from "./sources.js";
import { LooksTab } from "./view_looks.js";
import { WorldTab } from "./view_world.js";

export function mount(root, state, navigate, guide) {
  let [asked, there, shown, closed] = [state, null, null, false];
  const update = (state) => {
    asked = state;
    if (!there) return;
    const Tab = hasWorld(there.studies, state) ? WorldTab : LooksTab;
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
    const { studies, worldless, problems } = await watchable();
    for (const problem of problems) message(problem, "error");
    if (closed) return;
    const why = worldless.length
      ? "The studies here are of models whose lives have no world to watch."
      : "No study is stored here yet.";
    if (studies[0].id === PRESETS)
      message(`${why} These are the conditions that come with baldwinlab, lived as you watch.`);
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
