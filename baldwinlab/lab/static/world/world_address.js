/** Read and write the state of the World tab in the address. */

import { SPEEDS } from "./player.js";

const LIFE = ["study", "condition", "run", "generation"];
const TRAILS = ["off", "recent", "life"];

/** The camera of the complete map: its center as shares of the map, and the zoom. */
export const WHOLE_MAP = { x: 0.5, y: 0.5, zoom: 1 };

/** Return the lifetime to compare with, or null. */
export function readSecondLifetime(state, first) {
  if (state["b.condition"] === undefined && state["b.generation"] === undefined) return null;
  return Object.fromEntries(LIFE.map((key) => [key, state[`b.${key}`] ?? first[key]]));
}

/**
 * Return the options of the World tab, with defaults. `defaultSpeed` is not written to the address.
 */
export function readOptions(state, defaultSpeed) {
  const [x, y, zoom] = (state.zoom ?? "").split(",").map(Number);
  return {
    trails: TRAILS.includes(state.trails) ? state.trails : "recent",
    sight: state.sight !== "off",
    listing: state.agents === "listed",
    speed: SPEEDS.includes(Number(state.speed)) ? Number(state.speed) : defaultSpeed,
    camera: zoom ? { x, y, zoom } : WHOLE_MAP,
    step: state.step === undefined ? undefined : Math.max(0, Number(state.step) || 0),
    agent: state.agent === undefined || !(Number(state.agent) >= 0) ? null : Number(state.agent),
    showsAncestors: state.inside === "ancestors",
  };
}

/**
 * Return the state of a tab for the address.
 * @param {import("./world_tab.js").WorldTab} tab
 */
export function writeOptions(tab) {
  const { panels: [a, b], selectedMap, player, inspector } = tab;
  const { x, y, zoom } = a.map.view.camera;
  return {
    ...a.source,
    ...Object.fromEntries(LIFE.map((key) => [`b.${key}`, b ? b.source[key] : null])),
    step: tab.startAt ?? Math.floor(player.time),
    speed: player.speed === tab.defaultSpeed ? null : player.speed,
    agent: selectedMap.agent,
    inside: inspector.showsAncestors ? "ancestors" : null,
    side: selectedMap === b?.map ? "b" : null,
    trails: tab.trails === "recent" ? null : tab.trails,
    sight: tab.sight ? null : "off",
    agents: tab.listing ? "listed" : null,
    zoom: zoom === 1 ? null : `${x},${y},${zoom}`,
  };
}
