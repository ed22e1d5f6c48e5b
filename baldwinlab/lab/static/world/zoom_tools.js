/** The buttons that zoom a map. */

import { createIconButton } from "../core/common.js";

// Zoom factor of a press.
export const ZOOM_FACTOR = 1.5;

/** @type {Object<string, {label: string, path: string, act: (map: any) => void}>} */
const BUTTONS = {
  closer: { label: "Zoom in (+)", path: "M10 4v12M4 10h12", act: (map) => map.zoom(ZOOM_FACTOR) },
  farther: { label: "Zoom out (−)", path: "M4 10h12", act: (map) => map.zoom(1 / ZOOM_FACTOR) },
  all: {
    label: "Show the whole map (0)",
    path: "M3 7V3h4M13 3h4v4M17 13v4h-4M7 17H3v-4",
    act: (map) => map.fit(),
  },
};

/**
 * @param {import("./world_map.js").WorldMap} map
 * @param {("closer"|"farther"|"all")[]} names
 */
export function createZoomButtons(map, names) {
  return names.map((name) => {
    const { label, path, act } = BUTTONS[name];
    return createIconButton(label, path, () => act(map), { "data-testid": `zoom-${name}` });
  });
}
