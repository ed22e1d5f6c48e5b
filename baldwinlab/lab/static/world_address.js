/** How the World tab stands in the address: what an address asks of it, and what it writes there. */

import { SPEEDS } from "./player.js";

const LIFE = ["study", "condition", "run", "generation"];
const TRAILS = ["off", "recent", "life"];

/** Where the whole map is seen: the middle, as shares of it, and how many times it is enlarged. */
export const WHOLE_MAP = { x: 0.5, y: 0.5, zoom: 1 };

/** The life beside the first one, as far as the address names it; null: none. */
export function secondLifetime(state, first) {
  if (state["b.condition"] === undefined && state["b.generation"] === undefined) return null;
  return Object.fromEntries(LIFE.map((key) => [key, state[`b.${key}`] ?? first[key]]));
}

/** Everything but the lives; what an address leaves out is as at the beginning. `defaultSpeed` is the speed that is not written. */
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
    descent: state.inside === "ancestors",
  };
}

/** What the address says of a tab as it stands now. @param {import("./world_tab.js").WorldTab} tab */
export function writeOptions({ panels: [a, b], player, inspector, ...tab }) {
  const { x, y, zoom } = a.view.camera;
  return {
    ...a.source,
    ...Object.fromEntries(LIFE.map((key) => [`b.${key}`, b ? b.source[key] : null])),
    step: tab.startAt ?? Math.floor(player.time),
    speed: player.speed === tab.defaultSpeed ? null : player.speed,
    agent: tab.agent,
    inside: inspector.descent ? "ancestors" : null,
    side: tab.side === "b" ? "b" : null,
    trails: tab.trails === "recent" ? null : tab.trails,
    sight: tab.sight ? null : "off",
    agents: tab.listing ? "listed" : null,
    zoom: zoom === 1 ? null : `${x},${y},${zoom}`,
  };
}
