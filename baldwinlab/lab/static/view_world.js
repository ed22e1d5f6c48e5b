/** The World tab: one world or two in step, the controls of time, and the inspector. */

import { el, getJSON, message } from "./common.js";
import { Inspector } from "./inside.js";
import { Panel } from "./panel.js";
import { Player, SPEEDS } from "./player.js";
import { Population } from "./population.js";
import { mountShare } from "./share.js";
import { nearest, presetsAsStudy, query, rival } from "./sources.js";
import { Timeline } from "./timeline.js";
import { Transport } from "./transport.js";

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
    this.inspector = new Inspector({
      open: (source, agent) => this.openKin(source, agent),
      close: () => this.pick(this.side, null),
      seek: (step) => (step === null ? this.player.invalidate() : this.player.seek(step)),
    });
  }

  async start(state) {
    const { studies } = await getJSON("api/studies");
    for (const { problem } of studies) if (problem) message(problem, "error");
    this.worldless = studies.flatMap(({ id, conditions }) => conditions.filter(({ steps }) => !steps).map(({ name }) => ({ study: id, condition: name })));
    this.studies = studies
      .map((study) => ({ ...study, conditions: study.conditions.filter(({ runs, steps }) => runs.length && steps) }))
      .filter(({ conditions }) => conditions.length);
    const stored = this.studies.length > 0;
    if (!stored) this.studies = [await presetsAsStudy()];
    if (this.closed) return;
    const why = this.worldless.length ? "The studies here are of models whose lives have no world to watch." : "No study is stored here yet.";
    if (!stored) message(`${why} These are the conditions that come with baldwinlab, lived as you watch.`);
    this.build();
    this.apply(state);
    if (state.step === undefined) this.player.play();
  }

  build() {
    this.worlds = el("div", { class: "worlds" });
    const tell = { set: (change) => this.set(change), toggleBeside: () => this.toggleBeside(), fit: () => this.fit() };
    this.transport = new Transport(this.player, this.timeline, tell);
    this.root.append(this.worlds, el("div", { class: "side" }, this.population.root, this.inspector.root), this.transport.root);
    this.share = mountShare(document.getElementById("actions"), () => ({
      panels: this.panels.map(({ source, canvas }) => ({ source: String(query(source)), canvas })),
      step: Math.floor(this.player.time),
    }));
  }

  /** Show what an address says; what it leaves out is as at the beginning. */
  apply(state) {
    try {
      if (this.worldless.some(({ study, condition }) => study === state.study && condition === state.condition))
        throw new Error(`${state.condition} of ${state.study} is of a model whose lives have no world to watch.`);
      const first = nearest(this.studies, state, true);
      this.ensurePanel(0).choose(first);
      if (state["b.condition"] !== undefined || state["b.generation"] !== undefined) {
        const b = Object.fromEntries(
          ["study", "condition", "run", "generation"].map((key) => [key, state[`b.${key}`] ?? first[key]]),
        );
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
    this.transport.showKinds(this.panels.flatMap(({ life }) => life?.header?.look.item_kinds ?? []));
    this.player.last = Math.max(...lengths) - 1;
    this.timeline.setLast(this.player.last);
    if (this.startAt !== undefined) this.player.seek(Math.min(this.startAt, this.player.last));
    else if (this.player.time > this.player.last) this.player.seek(this.player.last);
    this.startAt = undefined;
    this.showTime();
  }

  draw(time) {
    let there = true;
    for (const panel of this.panels) {
      const chosen = panel.name === this.side ? this.agent : null;
      const drawn = panel.draw(time, { trails: this.trails, sight: this.sight, chosen });
      there &&= drawn.there;
      if (!drawn.ready) this.player.invalidate();
    }
    const step = Math.floor(time);
    const tracks = this.panels
      .filter(({ life }) => life)
      .map(({ life, name }) => ({ life, chosen: name === this.side ? this.agent : null }));
    if (tracks.length) this.timeline.draw(tracks);
    this.timeline.show(step);
    this.transport.showStep(step);
    const recording = this.panels[0]?.life?.at(step);
    if (recording && this.agent === null) this.population.draw(recording, Math.min(step, recording.last - 1));
    this.inspector.draw(step);
    if (this.player.playing) this.remember();
    return there && tracks.length > 0;
  }

  showTime() {
    if (!this.transport) return;
    this.transport.showTime();
    this.remember();
  }

  showOptions() {
    this.transport.showOptions({ trails: this.trails, sight: this.sight, beside: this.panels.length > 1 });
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
    const beside = Object.fromEntries(
      ["study", "condition", "run", "generation"].map((key) => [`b.${key}`, b ? b.source[key] : null]),
    );
    this.navigate(
      {
        ...a.source,
        ...beside,
        step: this.startAt ?? Math.floor(this.player.time),
        speed: this.player.speed === 10 ? null : this.player.speed,
        agent: this.agent,
        side: this.side === "b" ? "b" : null,
        trails: this.trails === "recent" ? null : this.trails,
        sight: this.sight ? null : "off",
        zoom: zoom === 1 ? null : `${x},${y},${zoom}`,
      },
      replace,
    );
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
    if (event.ctrlKey || event.metaKey || event.altKey || this.transport?.help.open) return;
    const at = event.target;
    if (
      at.matches?.("select, textarea, input:not([type=range], [type=checkbox])") ||
      (at.matches?.("button, a, input[type=checkbox]") && event.key === " ")
    )
      return;
    const generation = (by) => this.panels.forEach((panel) => panel.goTo(panel.source.generation + by));
    const acts = {
      " ": () => this.player.toggle(),
      ArrowLeft: () => this.player.step(event.shiftKey ? -100 : -1),
      ArrowRight: () => this.player.step(event.shiftKey ? 100 : 1),
      Home: () => this.player.seek(0),
      End: () => this.player.seek(this.player.last),
      "+": () => this.player.shift(1),
      "=": () => this.player.shift(1),
      "-": () => this.player.shift(-1),
      "[": () => generation(-1),
      "]": () => generation(1),
      0: () => this.fit(),
      c: () => this.toggleBeside(),
      Escape: () => this.pick(this.side, null),
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
