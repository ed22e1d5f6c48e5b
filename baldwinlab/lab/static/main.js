/** The page: select the view from the address. */

import {
  formatAddress,
  getCurrentView,
  navigate,
  readAddress,
  setCurrentView,
} from "./core/address.js";
import { el, getJSON, showConnection, showUnhandledErrors } from "./core/common.js";
import { Guide, LIVE, LIVE_TOPICS, PAPERS, RESULTS, RESULTS_TOPICS, WORLD } from "./core/guide.js";
import { loadFonts } from "./core/palette.js";
import { PRESETS } from "./core/sources.js";

const VIEWS = {
  papers: { title: "Papers", load: () => import("./papers/view_papers.js"), summary: PAPERS },
  world: {
    title: "World",
    hasStudy: true,
    simulates: true,
    load: () => import("./world/view_world.js"),
    // The recording provides the details.
    summary: WORLD,
  },
  live: {
    title: "Live run",
    simulates: true,
    load: loadLiveView,
    summary: LIVE,
    topics: LIVE_TOPICS,
  },
  results: {
    title: "Results",
    hasStudy: true,
    load: () => import("./results/view_results.js"),
    summary: RESULTS,
    topics: RESULTS_TOPICS,
  },
};

const root = document.getElementById("view");
const guide = new Guide(document.getElementById("about"));
// The state and scroll position of each view, by name. The last entry is the most recent.
const savedViews = new Map();
// {name, view}
let shown = null;
// A canvas needs the fonts before its first drawing.
const fonts = loadFonts();
// Milliseconds between two requests of the engine's state.
const ENGINE_INTERVAL = 100;
let isEngineReady = false;
// Milliseconds between two requests of any answer, and until a missing answer is reported.
const ANSWER_INTERVAL = 2000;
const MAX_ANSWER_TIME = 3000;
const NO_ANSWER = "The lab has not answered for 3 seconds. The page continues when it answers.";
// Waits until the scroll position can be restored.
let scrollObserver = null;

async function show() {
  const target = readAddress(Object.keys(VIEWS), "world");
  const current = getCurrentView();
  if (current && current.name !== target.name) {
    savedViews.delete(current.name);
    savedViews.set(current.name, { state: current.state, top: root.scrollTop });
  }
  // The link of a tab restores the last state of the view.
  const isTabLink = !Object.keys(target.state).length;
  if (isTabLink)
    target.state = current?.name === target.name ? current.state : restoreState(target.name);
  const { name, state } = target;
  for (const tab of document.querySelectorAll("[data-view]")) {
    if (tab.getAttribute("data-view") === name) tab.setAttribute("aria-current", "page");
    else tab.removeAttribute("aria-current");
  }
  if (shown?.name === name) {
    applyAddress(target, isTabLink);
    if (!isTabLink) shown.view.update(state);
    return;
  }
  setCurrentView(null);
  shown?.view.unmount();
  scrollObserver?.disconnect();
  document.getElementById("actions").replaceChildren();
  guide.setTexts(VIEWS[name].summary, VIEWS[name].topics);
  root.replaceChildren();
  root.className = `view-${name}`;
  document.title = `${VIEWS[name].title} · baldwinlab`;
  applyAddress(target, isTabLink);
  const instance = (shown = { name, view: { update() {}, unmount() {} } });
  // The modules of the view load at the same time as the engine.
  const [{ mount }] = await Promise.all([
    VIEWS[name].load(),
    fonts,
    VIEWS[name].simulates ? waitForEngine(() => shown === instance) : null,
  ]);
  // The user has opened another view in the meantime.
  if (shown !== instance) return;
  root.prepend(guide.root);
  instance.view = mount(root, getCurrentView().state, navigate, guide);
  if (state.study === savedViews.get(name)?.state.study) restoreScroll(savedViews.get(name)?.top);
}

/** Load the Live run tab with the agent inspector, which exported pages do not have. */
async function loadLiveView() {
  const [view, { Inspector }, { setInspector }] = await Promise.all([
    import("./live/view_live.js"),
    import("./inspector/inspector.js"),
    import("./live/live_world.js"),
  ]);
  setInspector(Inspector);
  return view;
}

/** Show a line until the engine is ready or the view is no longer current. */
async function waitForEngine(isCurrent) {
  const line = el("div", { class: "empty", role: "status" }, el("h1", {}, "The lab is starting …"));
  while (!isEngineReady) {
    isEngineReady = (await getJSON("api/engine")).ready;
    if (!isCurrent()) return;
    if (isEngineReady) break;
    root.replaceChildren(line);
    await new Promise((resolve) => setTimeout(resolve, ENGINE_INTERVAL));
  }
  line.remove();
}

/** Apply an address to the page and the guide. */
function applyAddress(target, isTabLink) {
  setCurrentView(target);
  if (isTabLink) formatAddress();
  guide.applyState(target.state);
}

/** Return the last state of a view. If another view showed a study later, return this study. */
function restoreState(name) {
  const saved = savedViews.get(name)?.state ?? {};
  const last = [...savedViews.values()].at(-1)?.state.study;
  return last && last !== PRESETS && last !== saved.study && VIEWS[name].hasStudy
    ? { study: last }
    : { ...saved };
}

/** Restore the scroll position when the page is long enough, unless the user scrolls first. */
function restoreScroll(top) {
  if (!top) return;
  const observer = new ResizeObserver(() => {
    root.scrollTop = top;
    if (Math.abs(root.scrollTop - top) < 2) observer.disconnect();
  });
  for (const part of root.children) observer.observe(part);
  for (const act of ["wheel", "pointerdown", "keydown"])
    root.addEventListener(act, () => observer.disconnect(), { once: true });
  scrollObserver = observer;
}

/**
 * Request an answer again and again, and show a banner while there is none. A server that is
 * suspended keeps its connections and does not answer.
 */
async function watchServer() {
  for (;;) {
    // A hidden page shows no banner.
    if (!document.hidden) await requestAnswer();
    await new Promise((resolve) => setTimeout(resolve, ANSWER_INTERVAL));
  }
}

/** Wait for an answer. The banner disappears with the first answer to any request. */
async function requestAnswer() {
  const timer = setTimeout(() => showConnection(false, NO_ANSWER), MAX_ANSWER_TIME);
  try {
    await getJSON("api/engine");
  } catch {
    // The banner shows errors of access. Other errors are answers.
  } finally {
    clearTimeout(timer);
  }
}

addEventListener("hashchange", show);
showUnhandledErrors();
show();
watchServer();
