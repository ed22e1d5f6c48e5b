/** The address of the page, `#/view?key=value`: it holds all that is shown, and follows what the reader does. */

const EVERY = 400; // ms; browsers refuse more than some hundred changes of the address in half a minute

let current = null; // {name, state} of the view on the page; null while one is on its way
let flushTimer = 0;
let lastHash = ""; // the last address that the page has heard of: with another one, the reader is already on the way elsewhere

/** What the address asks for: `#/world?study=a&step=3` as {name, state}. */
export function readAddress(views, defaultView) {
  const [path, query] = location.hash.replace(/^#\/?/, "").split("?");
  return {
    name: views.includes(path) ? path : defaultView,
    state: Object.fromEntries(new URLSearchParams(query ?? "")),
  };
}

/** From now on, this is what the page shows, and what the address follows. */
export function setCurrentView(view) {
  cancelFlush();
  current = view;
  lastHash = location.hash;
}

/** What the page shows now, as `follow` was told and `navigate` has changed it; null while a view is on its way. */
export function currentView() {
  return current && { ...current };
}

/**
 * Change the address. With `replace`, the address follows what the view shows already, and the view hears nothing; without,
 * it is a new place in the history and the view is updated. `patch.view` goes to another view, with the rest as its state.
 */
export function navigate(patch, replace = true) {
  if (!current) return;
  const { view, ...rest } = patch;
  if (view && view !== current.name) {
    location.hash = formatHash(view, rest);
    return;
  }
  const state = { ...current.state, ...rest };
  for (const [key, value] of Object.entries(state)) {
    if (value === null || value === undefined || value === "") delete state[key];
    else state[key] = String(value);
  }
  current.state = state;
  if (replace) flushTimer ||= setTimeout(flush, EVERY);
  else {
    cancelFlush();
    location.hash = formatHash(current.name, state);
  }
}

/** The address of exactly what is shown now. */
export function address() {
  flush();
  return location.href;
}

function formatHash(name, state) {
  const pairs = Object.entries(state).filter(
    ([, value]) => value !== null && value !== undefined && value !== "",
  );
  const query = pairs
    .map(
      ([key, value]) =>
        `${key}=${encodeURIComponent(value).replace(/%(2F|2C|7E)/g, decodeURIComponent)}`,
    )
    .join("&");
  return `#/${name}${query ? `?${query}` : ""}`;
}

function cancelFlush() {
  clearTimeout(flushTimer);
  flushTimer = 0;
}

function flush() {
  cancelFlush();
  if (!current || location.hash !== lastHash) return;
  history.replaceState(null, "", formatHash(current.name, current.state));
  lastHash = location.hash;
}

addEventListener("pagehide", () => flushTimer && flush());
