/** The page: which view is shown follows from the address, and the address follows from the view. */

import { message } from "./common.js";

const VIEWS = {
  world: () => import("./view_world.js"),
  live: () => import("./view_live.js"),
  results: () => import("./view_results.js"),
};
const ADDRESS_EVERY = 400; // ms; browsers refuse more than some hundred changes of the address in half a minute

let shown = null; // {name, view, state}
let turn = 0; // so that a slow view does not come up after a faster one
let waiting = 0;

/** `#/world?study=a&step=3` as {name, state}. */
function read() {
  const [path, query] = location.hash.replace(/^#\/?/, "").split("?");
  return { name: path in VIEWS ? path : "world", state: Object.fromEntries(new URLSearchParams(query ?? "")) };
}

function write(name, state) {
  const pairs = Object.entries(state).filter(([, value]) => value !== null && value !== undefined && value !== "");
  const query = pairs
    .map(([key, value]) => `${key}=${encodeURIComponent(value).replace(/%(2F|2C|7E)/g, decodeURIComponent)}`)
    .join("&");
  return `#/${name}${query ? `?${query}` : ""}`;
}

/**
 * Change the address. With `replace`, the address follows what the view shows already, and the view hears nothing; without,
 * it is a new place in the history and the view is updated. `patch.view` goes to another view, with the rest as its state.
 */
function navigate(patch, replace = true) {
  const { view, ...rest } = patch;
  if (view && view !== shown?.name) {
    location.hash = write(view, rest);
    return;
  }
  const state = { ...shown.state, ...rest };
  for (const [key, value] of Object.entries(state)) {
    if (value === null || value === undefined || value === "") delete state[key];
    else state[key] = String(value);
  }
  shown.state = state;
  if (replace) waiting ||= setTimeout(flush, ADDRESS_EVERY);
  else {
    drop();
    location.hash = write(shown.name, state);
  }
}

function drop() {
  clearTimeout(waiting);
  waiting = 0;
}

function flush() {
  drop();
  if (shown) history.replaceState(null, "", write(shown.name, shown.state));
}

/** The address of exactly what is shown now. */
export function address() {
  flush();
  return location.href;
}

async function show() {
  drop();
  const { name, state } = read();
  for (const tab of document.querySelectorAll("[data-view]")) {
    tab.dataset.view === name ? tab.setAttribute("aria-current", "page") : tab.removeAttribute("aria-current");
  }
  if (shown?.name === name) {
    shown.state = state;
    shown.view.update(state);
    return;
  }
  const mine = ++turn;
  const { mount } = await VIEWS[name]();
  if (mine !== turn) return;
  shown?.view.unmount();
  document.getElementById("actions").replaceChildren();
  const root = document.getElementById("view");
  root.replaceChildren();
  root.className = `view-${name}`;
  document.title = `${{ world: "World", live: "Live run", results: "Results" }[name]} · baldwinlab`;
  shown = { name, state, view: { update() {}, unmount() {} } };
  shown.view = mount(root, state, navigate);
}

addEventListener("hashchange", show);
addEventListener("pagehide", () => waiting && flush());
addEventListener("unhandledrejection", (event) => {
  event.preventDefault();
  if (event.reason?.name !== "AbortError") message(event.reason?.message ?? String(event.reason), "error");
});
show();
