/** The page: which view is shown follows from the address. */

import { asked, follow, navigate } from "./address.js";
import { message } from "./common.js";

const VIEWS = {
  world: { title: "World", lives: true, load: () => import("./view_world.js") },
  live: { title: "Live run", lives: true, load: () => import("./view_live.js") },
  results: { title: "Results", load: () => import("./view_results.js") },
};

let shown = null; // {name, view}
let turn = 0; // so that a slow view does not come up after a faster one

async function show() {
  const now = ++turn;
  const place = asked(Object.keys(VIEWS), "world");
  const { name, state } = place;
  follow(shown?.name === name ? place : null);
  for (const tab of document.querySelectorAll("[data-view]")) {
    tab.dataset.view === name ? tab.setAttribute("aria-current", "page") : tab.removeAttribute("aria-current");
  }
  if (shown?.name === name) {
    shown.view.update(state);
    return;
  }
  const { mount } = await VIEWS[name].load();
  if (now !== turn) return;
  shown?.view.unmount();
  document.getElementById("actions").replaceChildren();
  const root = document.getElementById("view");
  root.replaceChildren();
  root.className = `view-${name}`;
  document.title = `${VIEWS[name].title} · baldwinlab`;
  follow(place);
  const mine = (shown = { name, view: { update() {}, unmount() {} } });
  if (VIEWS[name].lives) await engineReady(root, () => shown === mine);
  if (shown === mine) mine.view = mount(root, asked(Object.keys(VIEWS), "world").state, navigate);
}

/** What lives waits for the engine. */
async function engineReady(root, wanted) {
  const { untilReady } = await import("./first_life.js");
  await untilReady(root, wanted);
}

addEventListener("hashchange", show);
addEventListener("unhandledrejection", (event) => {
  event.preventDefault();
  if (event.reason?.name !== "AbortError") message(event.reason?.message ?? String(event.reason), "error");
});
show();
