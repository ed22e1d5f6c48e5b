/** The state of the page in its address, `#/view?key=value`. */

// Milliseconds. Browsers refuse more than a few hundred changes of the address in 30 seconds.
const FLUSH_INTERVAL = 400;

// {name, state} of the current view, or null while a view loads.
let current = null;
let flushTimer = 0;
// The last address that the page handled. A different address means that the user navigates.
let lastHash = "";

/** Return the address as {name, state}: `#/world?study=a&step=3`. */
export function readAddress(views, defaultView) {
  const [path, query] = location.hash.replace(/^#\/?/, "").split("?");
  return {
    name: views.includes(path) ? path : defaultView,
    state: Object.fromEntries(new URLSearchParams(query ?? "")),
  };
}

/** Set the current view, whose state the address follows. */
export function setCurrentView(view) {
  cancelFlush();
  current = view;
  lastHash = location.hash;
}

/** Return the current view with the changes of `navigate`, or null while a view loads. */
export function getCurrentView() {
  return current && { ...current };
}

/**
 * Change the address.
 *
 * With `replace`, the view already shows the change and is not updated. Without it, the browser
 * history gets a new entry and the view is updated. `patch.view` opens another view with the rest
 * of the patch as its state.
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
  if (replace) flushTimer ||= setTimeout(flush, FLUSH_INTERVAL);
  else {
    cancelFlush();
    location.hash = formatHash(current.name, state);
  }
}

/** Return the address of the current state. */
export function formatAddress() {
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
