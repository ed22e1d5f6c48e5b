/** The buttons that zoom a map. */

import { createIconButton } from "../core/common.js";

const BUTTONS = {
  closer: ["Zoom in (+)", "M10 4v12M4 10h12"],
  farther: ["Zoom out (−)", "M4 10h12"],
  all: ["Show the whole map (0)", "M3 7V3h4M13 3h4v4M17 13v4h-4M7 17H3v-4"],
};
// Zoom factor of a press.
export const ZOOM_FACTOR = 1.5;

/**
 * @param {{zoom: (factor: number) => void, fit?: () => void}} actions without `fit`, the page has
 *   another button for the whole map
 * @returns {HTMLElement[]}
 */
export function createZoomButtons({ zoom, fit }) {
  return [
    createZoomButton("closer", () => zoom(ZOOM_FACTOR)),
    createZoomButton("farther", () => zoom(1 / ZOOM_FACTOR)),
    ...(fit ? [createZoomButton("all", fit)] : []),
  ];
}

function createZoomButton(name, action) {
  const [label, path] = BUTTONS[name];
  return createIconButton(label, path, action, { "data-testid": `zoom-${name}` });
}
