/** The address of the page, `#/view?key=value`: it holds all that is shown, and follows what the reader does. */

const EVERY = 400; // ms; browsers refuse more than some hundred changes of the address in half a minute

let shown = null; // {name, state} of the view on the page; null while one is on its way
let waiting = 0;
let seen = ""; // the last address that the page has heard of: with another one, the reader is already on the way elsewhere

/** What the address asks for: `#/world?study=a&step=3` as {name, state}. */
export function asked(views, otherwise) {
  const [path, query] = location.hash.replace(/^#\/?/, "").split("?");
  return {
    name: views.includes(path) ? path : otherwise,
    state: Object.fromEntries(new URLSearchParams(query ?? "")),
  };
}

/** From now on, this is what the page shows, and what the address follows. */
export function follow(place) {
  drop();
  shown = place;
  seen = location.hash;
}

/** What the page shows now, as `follow` was told and `navigate` has changed it; null while a view is on its way. */
export function followed() {
  return shown && { ...shown };
}

/**
 * Change the address. With `replace`, the address follows what the view shows already, and the view hears nothing; without,
 * it is a new place in the history and the view is updated. `patch.view` goes to another view, with the rest as its state.
 */
export function navigate(patch, replace = true) {
  if (!shown) return;
  const { view, ...rest } = patch;
  if (view && view !== shown.name) {
    location.hash = written(view, rest);
    return;
  }
  const state = { ...shown.state, ...rest };
  for (const [key, value] of Object.entries(state)) {
    if (value === null || value === undefined || value === "") delete state[key];
    else state[key] = String(value);
  }
  shown.state = state;
  if (replace) waiting ||= setTimeout(flush, EVERY);
  else {
    drop();
    location.hash = written(shown.name, state);
  }
}

/** The address of exactly what is shown now. */
export function address() {
  flush();
  return location.href;
}

function written(name, state) {
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

function drop() {
  clearTimeout(waiting);
  waiting = 0;
}

function flush() {
  drop();
  if (!shown || location.hash !== seen) return;
  history.replaceState(null, "", written(shown.name, shown.state));
  seen = location.hash;
}

addEventListener("pagehide", () => waiting && flush());
