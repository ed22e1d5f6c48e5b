/** The replay page: a file with all its modules (downloads.py). It makes no requests. */

import { el, formatNumber, inflate, unpack } from "../core/common.js";
import { loadFonts } from "../core/palette.js";
import { Legend } from "../world/legend.js";
import { Recording } from "../world/recording.js";
import { addFigure } from "../world/world_figure.js";
import { WorldGroup } from "../world/world_group.js";

/**
 * Fill the page and start the replay.
 * @param {HTMLElement} root is emptied and filled
 * @param {{version: string, step: number, panels: {title: string, recording: string, experiment:
 *   string|null, commands: string[]}[]}} replay
 */
export async function play(root, replay) {
  await loadFonts();
  const recordings = await Promise.all(
    replay.panels.map(async ({ recording }) => new Recording(unpack(await inflate(recording)))),
  );
  const group = new WorldGroup("replay-");
  const figures = replay.panels.map(({ title }) =>
    addFigure(group, `World: ${title}`, "replay-canvas")
  );
  const legend = new Legend();
  legend.show(recordings.map(({ header }) => header));
  const panels = replay.panels.map((panel, index) =>
    createPanel(panel, recordings[index], figures[index])
  );
  const heading = el("h1", { class: "visually-hidden" }, "Replay of a lifetime");
  root.replaceChildren(
    heading,
    el("div", { class: "replay-panels" }, ...panels),
    group.bar.createRow(),
    legend.root,
    createAboutSection(replay),
  );
  group.showRecordings(recordings);
  addEventListener("keydown", (event) => handleReplayKey(event, group));
  group.player.seek(replay.step);
}

function createPanel({ title }, { header }, { stage, foot, facts }) {
  const agents = `${formatNumber(header.agents)} agents`;
  const text = `seed ${header.seed}, ${agents}, ${describeItems(header)}`;
  const part = header.last - header.first < header.steps
    ? `; steps ${header.first} to ${header.last - 1} of ${header.steps}`
    : "";
  return el(
    "figure",
    {},
    el("figcaption", {}, el("strong", {}, title), el("span", { class: "soft" }, text + part)),
    stage,
    foot,
    facts,
  );
}

/** Return a text such as: 50 items of food. */
function describeItems({ appearance: { item_kinds } }) {
  return item_kinds
    .map(({ name, number }) => `${formatNumber(number)} items of ${name}`)
    .join(", ");
}

function createAboutSection({ version, panels }) {
  const parts = panels.flatMap(({ title, experiment, commands }) => [
    el("h2", {}, title),
    experiment && el("p", {}, "Save this text as ", el("code", {}, "experiment.toml"), ":"),
    experiment && el("pre", { "data-testid": "replay-experiment" }, experiment),
    el("pre", { "data-testid": "replay-commands" }, commands.join("\n")),
  ]);
  const text = `Made with baldwinlab ${version}, a laboratory for evolution and lifetime ` +
    "learning. These commands reproduce exactly the same lifetime.";
  return el(
    "details",
    { class: "replay-about" },
    el("summary", {}, `About this replay, and how to reproduce it (baldwinlab ${version})`),
    el("p", {}, text),
    ...parts,
  );
}

/** Escape deselects the agent. Other keys control the time bar. */
function handleReplayKey(event, group) {
  if (event.key === "Escape") group.maps.forEach((map) => group.selectAgent(map, null));
  else group.bar.handleKey(event);
}
