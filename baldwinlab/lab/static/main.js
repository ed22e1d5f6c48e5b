/** The page: which view is shown follows from the address. */

import { address, asked, follow, followed, navigate } from "./address.js";
import { message } from "./common.js";
import { Guide } from "./guide.js";
import { PRESETS } from "./sources.js";
import { LIVE, PAPERS, RESULTS, SAVING } from "./topics.js";

const VIEWS = {
  papers: { title: "Papers", load: () => import("./view_papers.js"), about: PAPERS },
  world: {
    title: "World",
    ofStudy: true,
    lives: true,
    load: () => import("./view_world.js"),
    about: [],
  }, // what it shows is in the recording's own words
  live: {
    title: "Live run",
    lives: true,
    load: () => import("./view_live.js"),
    about: [...LIVE, SAVING],
  },
  results: {
    title: "Results",
    ofStudy: true,
    load: () => import("./view_results.js"),
    about: RESULTS,
  },
};

const root = document.getElementById("view");
const guide = new Guide(document.getElementById("about"));
const left = new Map(); // by name, how views were left: {state, top}, the last one at the end
let shown = null; // {name, view}
let returning = null; // watches for the place to scroll back to

async function show() {
  const place = asked(Object.keys(VIEWS), "world");
  const now = followed();
  if (now && now.name !== place.name) {
    left.delete(now.name);
    left.set(now.name, { state: now.state, top: root.scrollTop });
  }
  const bare = !Object.keys(place.state).length; // as a tab's link is: the view as it was
  if (bare) place.state = now?.name === place.name ? now.state : asLeft(place.name);
  const { name, state } = place;
  for (const tab of document.querySelectorAll("[data-view]")) {
    tab.dataset.view === name
      ? tab.setAttribute("aria-current", "page")
      : tab.removeAttribute("aria-current");
  }
  if (shown?.name === name) {
    settle(place, bare);
    if (!bare) shown.view.update(state);
    return;
  }
  follow(null);
  shown?.view.unmount();
  returning?.disconnect();
  document.getElementById("actions").replaceChildren();
  guide.begin(name, VIEWS[name].about);
  root.replaceChildren();
  root.className = `view-${name}`;
  document.title = `${VIEWS[name].title} · baldwinlab`;
  settle(place, bare);
  const here = (shown = { name, view: { update() {}, unmount() {} } });
  if (VIEWS[name].lives) await engineReady(() => shown === here);
  const { mount } = await VIEWS[name].load();
  if (shown !== here) return; // a faster one has been asked for meanwhile
  root.prepend(guide.root);
  here.view = mount(root, followed().state, navigate, guide);
  if (state.study === left.get(name)?.state.study) scrollBack(left.get(name)?.top);
}

/** What lives waits for the engine. */
async function engineReady(wanted) {
  const { waitForEngine } = await import("./waiting_screen.js");
  await waitForEngine(root, wanted);
}

/** The address, and the guide, say what is shown from now on. */
function settle(place, bare) {
  follow(place);
  if (bare) address();
  guide.follow(place.state);
}

/** A view as it was left; but where another study has been looked at since, that one. */
function asLeft(name) {
  const before = left.get(name)?.state ?? {};
  const last = [...left.values()].at(-1)?.state.study;
  return last && last !== PRESETS && last !== before.study && VIEWS[name].ofStudy
    ? { study: last }
    : { ...before };
}

/** Down to where the reader was, once the page has become as long again, unless the reader goes elsewhere first. */
function scrollBack(top) {
  if (!top) return;
  const grown = new ResizeObserver(() => {
    root.scrollTop = top;
    if (Math.abs(root.scrollTop - top) < 2) grown.disconnect();
  });
  for (const part of root.children) grown.observe(part);
  for (const act of ["wheel", "pointerdown", "keydown"])
    root.addEventListener(act, () => grown.disconnect(), { once: true });
  returning = grown;
}

addEventListener("hashchange", show);
addEventListener("unhandledrejection", (event) => {
  event.preventDefault();
  if (event.reason?.name !== "AbortError")
    message(event.reason?.message ?? String(event.reason), "error");
});
show();
