/** The World tab: one world or two in step, the controls of time, and the inspector. */

import { el, getJSON, icon, message } from "./common.js";
import { Inspector } from "./inside.js";
import { PRESETS, Panel, nearest, query } from "./panel.js";
import { Player, SPEEDS } from "./player.js";
import { Population } from "./population.js";
import { mountShare } from "./share.js";
import { Timeline } from "./timeline.js";
import { DARK, LIGHT } from "./palette.js";

const PATHS = {
  play: "M6 4l10 6-10 6z", pause: "M7 4v12M13 4v12", back: "M12 5l-6 5 6 5zM15 5v10", on: "M8 5l6 5-6 5zM5 5v10",
  fit: "M3 7V3h4M13 3h4v4M17 13v4h-4M7 17H3v-4", beside: "M3 4h6v12H3zM11 4h6v12h-6z", close: "M5 5l10 10M15 5L5 15", keys: "M2 6h16v9H2zM5 9h.01M8 9h.01M11 9h.01M14 9h.01M6 12h8",
};
const KEYS = [["space", "play or pause"], ["← →", "a step back or on (with shift: 100)"], ["Home End", "first or last step"], ["+ −", "faster or slower"],
  ["[ ]", "generation before or after"], ["0", "the whole map"], ["c", "side by side"], ["Esc", "close the inspector"]];

export function mount(root, state, navigate) {
  const view = new WorldTab(root, navigate);
  view.start(state);
  return { update: (given) => view.apply(given), unmount: () => view.close() };
}

class WorldTab {
  constructor(root, navigate) {
    Object.assign(this, { root, navigate, panels: [], agent: null, side: "a", trails: "recent", sight: true, closed: false });
    this.player = new Player((time) => this.draw(time));
    this.player.changed = () => this.showTime();
    this.scheme = matchMedia("(prefers-color-scheme: dark)");
    this.onscheme = () => this.player.invalidate();
    this.onkey = (event) => this.key(event);
    this.scheme.addEventListener("change", this.onscheme);
    addEventListener("keydown", this.onkey);
    this.timeline = new Timeline((step) => this.player.seek(step));
    this.population = new Population((agent) => this.pick("a", agent));
    this.inspector = new Inspector({ open: (source, agent) => this.openKin(source, agent), close: () => this.pick(this.side, null), seek: (step) => (step === null ? this.player.invalidate() : this.player.seek(step)) });
  }

  async start(state) {
    const { studies } = await getJSON("api/studies");
    for (const { problem } of studies) if (problem) message(problem, "error");
    this.studies = studies.map((study) => ({ ...study, conditions: study.conditions.filter(({ runs }) => runs.length) })).filter(({ conditions }) => conditions.length);
    if (!this.studies.length) this.studies = [await presetsAsStudy()];
    if (this.closed) return;
    this.build();
    this.apply(state);
    if (state.step === undefined) this.player.play();
  }

  build() {
    this.worlds = el("div", { class: "worlds" });
    this.root.append(this.worlds, el("div", { class: "side" }, this.population.root, this.inspector.root), this.makeTransport());
    this.share = mountShare(document.getElementById("actions"), () => ({
      panels: this.panels.map(({ source, canvas }) => ({ source: String(query(source)), canvas })), step: Math.floor(this.player.time),
    }));
  }

  makeTransport() {
    const button = (name, label, act, extra = {}) => el("button", { type: "button", "aria-label": label, title: label, "data-testid": name, onclick: act, class: "quiet square", ...extra }, icon(PATHS[name]));
    this.playButton = button("play", "Play (space)", () => this.player.toggle(), { class: "primary round" });
    this.speed = el("select", { "aria-label": "Speed", "data-testid": "speed", onchange: () => this.player.setSpeed(this.speed.value) },
      SPEEDS.map((speed) => el("option", { value: speed }, `${speed}×`)));
    this.clock = el("output", { class: "clock number", "data-testid": "step" });
    this.trailsList = el("select", { "aria-label": "Trails", "data-testid": "trails", onchange: () => this.set({ trails: this.trailsList.value }) },
      [["off", "no trails"], ["recent", "recent trails"], ["life", "whole trails"]].map(([value, label]) => el("option", { value }, label)));
    this.sightBox = el("input", { type: "checkbox", "data-testid": "sight", onchange: () => this.set({ sight: this.sightBox.checked }) });
    this.besideButton = el("button", { type: "button", "data-testid": "compare", title: "Two lives in step, from the same start (c)", onclick: () => this.toggleBeside() }, icon(PATHS.beside), el("span", { class: "wide" }, "Compare"));
    this.help = el("dialog", {}, el("h2", {}, "Keys"), el("table", {}, KEYS.map(([key, what]) => el("tr", {}, el("td", {}, el("code", {}, key)), el("td", {}, what)))),
      el("p", { class: "soft" }, "Wheel or pinch zooms, dragging moves, a click or tap on an agent opens it."), el("form", { method: "dialog" }, el("button", { class: "primary" }, "Close")));
    return el("div", { class: "transport" }, this.timeline.root, el("div", { class: "controls" },
      el("div", { class: "row time" }, button("back", "A step back (←)", () => this.player.step(-1)), this.playButton, button("on", "A step on (→)", () => this.player.step(1)),
        this.speed, this.clock),
      legend(),
      el("div", { class: "row options" }, this.trailsList, el("label", { class: "inline" }, this.sightBox, "sight"),
        this.besideButton, button("fit", "The whole map (0)", () => this.fit()), button("keys", "Keys", () => this.help.showModal())), this.help));
  }

  /** Show what an address says; what it leaves out is as at the beginning. */
  apply(state) {
    try {
      const first = nearest(this.studies, state, true);
      this.ensurePanel(0).choose(first);
      if (state["b.condition"] !== undefined || state["b.generation"] !== undefined) {
        const b = Object.fromEntries(["study", "condition", "run", "generation"].map((key) => [key, state[`b.${key}`] ?? first[key]]));
        this.ensurePanel(1).choose(nearest(this.studies, b, true));
      } else this.dropBeside();
    } catch (fault) {
      message(fault.message, "error");
      if (!this.panels[0]?.source) this.ensurePanel(0).choose(nearest(this.studies, {}));
    }
    this.trails = ["off", "recent", "life"].includes(state.trails) ? state.trails : "recent";
    this.sight = state.sight !== "off";
    this.player.speed = SPEEDS.includes(Number(state.speed)) ? Number(state.speed) : 10;
    const [x, y, zoom] = (state.zoom ?? "").split(",").map(Number);
    for (const { view } of this.panels) view.look(...(zoom ? [x, y, zoom] : [0.5, 0.5, 1]));
    if (state.step !== undefined) this.startAt = Math.max(0, Number(state.step) || 0);
    if (this.panels.every(({ coming }) => !coming)) this.loaded();
    this.side = state.side === "b" && this.panels[1] ? "b" : "a";
    this.agent = state.agent === undefined || !(Number(state.agent) >= 0) ? null : Number(state.agent);
    this.showOptions();
    this.showTime();
    this.inspect();
    this.player.invalidate();
  }

  ensurePanel(number) {
    if (this.panels[number]) return this.panels[number];
    const name = "ab"[number];
    const panel = new Panel(name, this.studies, {
      invalidate: () => this.player.invalidate(),
      chosen: () => this.sourceChosen(),
      loaded: () => this.loaded(),
      failed: (fault) => message(fault.message, "error"),
      picked: (agent) => this.pick(name, agent),
      moved: () => this.moved(panel),
      fitted: () => this.fit(),
    });
    this.panels[number] = panel;
    this.worlds.append(panel.root);
    this.root.classList.toggle("beside", this.panels.length > 1);
    return panel;
  }

  dropBeside() {
    this.panels.splice(1).forEach((panel) => panel.close());
    this.root.classList.remove("beside");
    if (this.side === "b") Object.assign(this, { side: "a", agent: null });
  }

  toggleBeside() {
    if (this.panels.length > 1) this.dropBeside();
    else this.ensurePanel(1).choose(rival(this.panels[0]));
    this.loaded();
    this.sourceChosen();
  }

  sourceChosen() {
    this.inspect();
    this.showOptions();
    this.remember(false);
  }

  /** A life has come: time reaches to the end of the longest. */
  loaded() {
    const lengths = this.panels.filter(({ life }) => life?.steps).map(({ life }) => life.steps);
    if (!lengths.length) return;
    this.player.last = Math.max(...lengths) - 1;
    this.timeline.setLast(this.player.last);
    if (this.startAt !== undefined) this.player.seek(Math.min(this.startAt, this.player.last));
    else if (this.player.time > this.player.last) this.player.seek(this.player.last);
    this.startAt = undefined;
    this.showTime();
  }

  draw(time) {
    const palette = this.scheme.matches ? DARK : LIGHT;
    let there = true;
    for (const panel of this.panels) {
      const chosen = panel.name === this.side ? this.agent : null;
      const drawn = panel.draw(time, { palette, trails: this.trails, sight: this.sight, chosen });
      there &&= drawn.there;
      if (!drawn.ready) this.player.invalidate();
    }
    const step = Math.floor(time);
    const tracks = this.panels.filter(({ life }) => life).map(({ life, name }) => ({ life, colour: palette.food, chosen: name === this.side ? this.agent : null }));
    if (tracks.length) this.timeline.draw(tracks, palette);
    this.timeline.show(step);
    const text = `${step.toLocaleString("en")} / ${this.player.last.toLocaleString("en")}`;
    if (this.clock.textContent !== text) this.clock.textContent = text;
    const recording = this.panels[0]?.life?.at(step);
    if (recording && this.agent === null) this.population.draw(recording, Math.min(step, recording.last - 1));
    this.inspector.draw(step, palette);
    if (this.player.playing) this.remember();
    return there && tracks.length > 0;
  }

  showTime() {
    if (!this.playButton) return;
    const { playing, speed } = this.player;
    this.playButton.replaceChildren(icon(PATHS[playing ? "pause" : "play"]));
    this.playButton.setAttribute("aria-label", playing ? "Pause (space)" : "Play (space)");
    this.playButton.dataset.playing = playing;
    this.speed.value = String(speed);
    this.remember();
  }

  showOptions() {
    this.trailsList.value = this.trails;
    this.sightBox.checked = this.sight;
    this.besideButton.setAttribute("aria-pressed", this.panels.length > 1);
  }

  set(change) {
    Object.assign(this, change);
    this.showOptions();
    this.remember();
    this.player.invalidate();
  }

  /** The address follows what is shown; another life is a new place in the history. */
  remember(replace = true) {
    const [a, b] = this.panels;
    if (!a?.source) return;
    const { x, y, zoom } = a.view.camera;
    const beside = Object.fromEntries(["study", "condition", "run", "generation"].map((key) => [`b.${key}`, b ? b.source[key] : null]));
    this.navigate({
      ...a.source, ...beside, step: this.startAt ?? Math.floor(this.player.time), speed: this.player.speed === 10 ? null : this.player.speed,
      agent: this.agent, side: this.side === "b" ? "b" : null, trails: this.trails === "recent" ? null : this.trails,
      sight: this.sight ? null : "off", zoom: zoom === 1 ? null : `${x},${y},${zoom}`,
    }, replace);
  }

  /** Both worlds are looked at from the same place. */
  moved(from) {
    const { x, y, zoom } = from.view.camera;
    for (const { view } of this.panels) view.look(x, y, zoom);
    this.remember();
    this.player.invalidate();
  }

  fit() {
    for (const { view } of this.panels) view.look(0.5, 0.5, 1);
    this.remember();
    this.player.invalidate();
  }

  pick(side, agent) {
    Object.assign(this, { side, agent });
    this.inspect();
    this.remember();
    this.player.invalidate();
  }

  inspect() {
    const panel = this.panels.find(({ name }) => name === this.side);
    this.root.classList.toggle("inspecting", this.agent !== null);
    if (this.agent === null || !panel?.source) this.inspector.hide();
    else this.inspector.show(panel.source, this.agent);
  }

  /** The life of a parent or a child, in the generation before or after. */
  openKin(source, agent) {
    this.agent = agent;
    this.panels.find(({ name }) => name === this.side).choose(source);
    this.player.seek(0);
    this.sourceChosen();
  }

  key(event) {
    if (event.ctrlKey || event.metaKey || event.altKey || this.help?.open) return;
    const at = event.target;
    if (at.matches?.("select, textarea, input:not([type=range], [type=checkbox])") || (at.matches?.("button, a, input[type=checkbox]") && event.key === " ")) return;
    const generation = (by) => this.panels.forEach((panel) => panel.goTo(panel.source.generation + by));
    const acts = {
      " ": () => this.player.toggle(), ArrowLeft: () => this.player.step(event.shiftKey ? -100 : -1), ArrowRight: () => this.player.step(event.shiftKey ? 100 : 1),
      Home: () => this.player.seek(0), End: () => this.player.seek(this.player.last), "+": () => this.player.shift(1), "=": () => this.player.shift(1), "-": () => this.player.shift(-1),
      "[": () => generation(-1), "]": () => generation(1), 0: () => this.fit(), c: () => this.toggleBeside(), Escape: () => this.pick(this.side, null),
    };
    const act = acts[event.key];
    if (!act || !this.panels.length) return;
    event.preventDefault();
    act();
  }

  close() {
    this.closed = true;
    this.share?.close();
    this.player.close();
    this.scheme.removeEventListener("change", this.onscheme);
    removeEventListener("keydown", this.onkey);
    this.panels.forEach((panel) => panel.close());
    this.inspector.hide();
  }
}

function legend() {
  const entry = (mark, text) => el("span", { class: "entry" }, el("i", { class: `mark ${mark}` }), text);
  return el("div", { class: "legend", "aria-label": "Legend" }, entry("agent", "has eaten"), entry("hungry", "never ate"), entry("food", "food"), entry("lit", "sensor fires"), entry("meal", "eats now"));
}

/** What to set beside a life: the next condition on the same map, or else the first generation. */
function rival({ source, conditions }) {
  const map = source.condition.split("/").pop();
  const other = ["evo", "evo+self-taught"].map((name) => `${name}/${map}`).concat(conditions.map(({ name }) => name).filter((name) => name.endsWith(`/${map}`)))
    .find((name) => name !== source.condition && conditions.some((one) => one.name === name && one.runs.includes(source.run) && one.generations > source.generation));
  return other ? { ...source, condition: other } : { ...source, generation: source.generation === 0 ? (conditions[0]?.generations ?? 1) - 1 : 0 };
}

/** Where nothing is stored, the conditions that come with baldwinlab can be watched all the same. */
async function presetsAsStudy() {
  const { presets } = await getJSON("api/presets");
  const runs = Array.from({ length: 10 }, (_, run) => run);
  return { id: PRESETS, conditions: presets.map(({ name }) => ({ name, runs, generations: 100, agents: 20, steps: 5000 })) };
}
