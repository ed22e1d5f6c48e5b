/** A replay on a page of its own: share.py writes it into a file, with all that it imports. It asks nobody for anything. */

import { el, format, icon, unpack } from "./common.js";
import { Player, SPEEDS } from "./player.js";
import { Recording } from "./recording.js";
import { WorldView } from "./world.js";

const PLAY = "M6 4l10 6-10 6z";
const PAUSE = "M7 4v12M13 4v12";
const BACK = "M12 5l-5 5 5 5";
const ON = "M8 5l5 5-5 5";

/**
 * @param {HTMLElement} root is emptied and filled
 * @param {{version: string, step: number, panels: {title: string, recording: string, experiment: string|null, commands: string[]}[]}} replay
 */
export async function play(root, replay) {
  const recordings = await Promise.all(replay.panels.map(async ({ recording }) => new Recording(unpack(await inflate(recording)))));
  const player = new Player((time) => {
    const ready = views.map((view, place) => view.draw(recordings[place], Math.max(time, recordings[place].first)));
    showTime(Math.floor(time));
    if (ready.includes(false)) player.invalidate();
    return true;
  });
  player.last = Math.max(...recordings.map(({ last }) => last)) - 1;
  const { bar, showTime } = controls(player);
  const panels = replay.panels.map((panel, place) => figure(panel, recordings[place]));
  const title = el("h1", { class: "visually-hidden" }, "A lifetime, lived again");
  root.replaceChildren(title, el("div", { class: "replay-panels" }, ...panels), bar, about(replay));
  const views = panels.map((panel) => new WorldView(panel.querySelector("canvas")));
  const resized = new ResizeObserver(() => {
    views.forEach((view) => view.resize());
    player.invalidate();
  });
  views.forEach(({ canvas }) => resized.observe(canvas));
  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => player.invalidate());
  addEventListener("keydown", (event) => steer(event, player));
  player.seek(replay.step);
}

/** Base64 of deflated bytes, unpacked. */
async function inflate(text) {
  const packed = Uint8Array.from(atob(text), (letter) => letter.charCodeAt(0));
  return new Response(new Blob([packed]).stream().pipeThrough(new DecompressionStream("deflate-raw"))).arrayBuffer();
}

function figure({ title }, { header }) {
  const facts = `seed ${header.seed}, ${format(header.agents)} agents, ${items(header)}`;
  const part = header.last - header.first < header.steps ? `; steps ${header.first} to ${header.last - 1} of ${header.steps}` : "";
  const canvas = el("canvas", { role: "img", "aria-label": `The world of ${title}`, "data-testid": "replay-canvas" });
  return el("figure", {}, el("figcaption", {}, el("strong", {}, title), el("span", { class: "soft" }, facts + part)), canvas);
}

/** Such as: 50 items of food. */
function items({ look: { item_kinds } }) {
  return item_kinds.map(({ name, number }) => `${format(number)} items of ${name}`).join(", ");
}

/** The bar of controls, and what keeps it at the step that is shown. */
function controls(player) {
  const button = (label, path, act, testid, shape = "square") =>
    el("button", { type: "button", class: shape, "aria-label": label, "data-testid": testid, onclick: act }, icon(path));
  const toggle = button("Play", PLAY, () => player.toggle(), "replay-play", "primary round");
  const scrub = el("input", { type: "range", min: 0, max: player.last, value: 0, "aria-label": "Step", "data-testid": "replay-scrub",
    oninput: () => player.seek(Number(scrub.value)) });
  const step = el("output", { class: "number", "data-testid": "replay-step" });
  const speeds = SPEEDS.map((speed) => el("option", { value: speed, selected: speed === player.speed }, `${speed}×`));
  const speed = el("select", { "aria-label": "Speed", "data-testid": "replay-speed", onchange: () => player.setSpeed(speed.value) }, ...speeds);
  player.changed = () => {
    toggle.setAttribute("aria-label", player.playing ? "Pause" : "Play");
    toggle.replaceChildren(icon(player.playing ? PAUSE : PLAY));
  };
  const showTime = (now) => {
    scrub.value = now;
    step.textContent = `step ${format(now)} of ${format(player.last + 1)}`;
  };
  const back = button("One step back", BACK, () => player.step(-1), "replay-back");
  const on = button("One step on", ON, () => player.step(1), "replay-on");
  return { bar: el("div", { class: "replay-bar", role: "group", "aria-label": "Time" }, toggle, back, on, scrub, step, speed), showTime };
}

function about({ version, panels }) {
  const parts = panels.flatMap(({ title, experiment, commands }) => [
    el("h2", {}, title),
    experiment && el("p", {}, "Keep this as ", el("code", {}, "experiment.toml"), ":"),
    experiment && el("pre", { "data-testid": "replay-experiment" }, experiment),
    el("pre", { "data-testid": "replay-commands" }, commands.join("\n")),
  ]);
  const what = `Made with baldwinlab ${version}, a laboratory for evolution and lifetime learning. The same commands give the same lifetime, to the bit.`;
  return el("details", { class: "replay-about" }, el("summary", {}, `What this is, and how to live it again (baldwinlab ${version})`), el("p", {}, what), ...parts);
}

/** Space plays and pauses; the arrows go a step, with shift ten. Controls that have the focus keep their own keys. */
function steer(event, player) {
  const own = event.target.matches("input, select") || (event.key === " " && event.target.matches("button, summary"));
  if (own || event.ctrlKey || event.metaKey || event.altKey) return;
  const by = { ArrowLeft: -1, ArrowRight: 1 }[event.key];
  if (event.key === " ") player.toggle();
  else if (by) player.step(event.shiftKey ? 10 * by : by);
  else return;
  event.preventDefault();
}
