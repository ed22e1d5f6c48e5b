/** The notice that replaces the World tab if the address names no lifetime. */

import { el } from "../core/common.js";
import { findNearestLifetime, formatLifetimeAddress, requireViewable } from "../core/sources.js";
import { readSecondLifetime } from "./world_address.js";

/**
 * Throw MissingLifetimeError if the address names lifetimes that cannot be shown.
 * @param {import("../core/sources.js").Stored} stored
 * @param {Object<string, string>} state
 */
export function requireLifetimes(stored, state) {
  requireViewable(stored, state);
  const first = findNearestLifetime(stored.studies, state, true);
  const second = readSecondLifetime(state, first);
  if (second) findNearestLifetime(stored.studies, second, true);
}

/**
 * Return a message with links to lifetimes that exist.
 * @param {import("../core/sources.js").MissingLifetimeError} error
 */
export function createMissingNotice({ message, choices }) {
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
