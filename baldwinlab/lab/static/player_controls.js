/** The play button and the list of speeds of a player. */

import { createButton, createIcon, createSelect } from "./common.js";
import { SPEEDS } from "./player.js";

const PLAY = "M6 4l10 6-10 6z";
const PAUSE = "M7 4v12M13 4v12";

/** Return the play button. `showPlaying` sets its icon. */
export function createPlayButton(testid, toggle) {
  return createButton("", toggle, { class: "primary round", "data-testid": testid });
}

/** Show the action of the play button. `key` is its shortcut. */
export function showPlaying(button, isPlaying, key = "") {
  button.setAttribute("aria-label", (isPlaying ? "Pause" : "Play") + key);
  button.replaceChildren(createIcon(isPlaying ? PAUSE : PLAY));
}

/** @param {import("./player.js").Player} player */
export function createSpeedList(player, testid) {
  return createSelect(
    SPEEDS.map((speed) => [speed, `${speed}×`]),
    player.speed,
    (speed) => player.setSpeed(speed),
    { "aria-label": "Speed", "data-testid": testid },
  );
}
