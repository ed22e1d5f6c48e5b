/** The world of a live run: of its newest generation, as one follows the other, or of one that the reader looks at. */

import { el, getBinary, message } from "./common.js";
import { Inspector } from "./inspector.js";
import { Legend } from "./legend.js";
import { Player } from "./player.js";
import { Lifetime, Recording } from "./recording.js";
import { mountShare } from "./share.js";
import { query } from "./sources.js";
import { TimeBar } from "./time_bar.js";
import { WorldFigure } from "./world_figure.js";

const HOLD = 1000; // ms for which a generation is to be seen before a newer one takes its place
const SPEED = 100;

export class LiveWorld {
  /**
   * @param {string} id of the live run
   * @param {number} runs
   * @param {Object<string, string>} state of the address: speed; run, generation, step and agent of the world, the newest without
   * @param {(patch: Object<string, any>) => void} navigate
   */
  constructor(id, runs, state, navigate) {
    Object.assign(this, {
      id,
      navigate,
      lived: 0,
      life: null,
      coming: null,
      generation: null,
      kept: null,
      since: 0,
      waiting: 0,
    });
    this.run = Math.min(wholeNumber(state.run) ?? 0, runs - 1);
    this.asked = { generation: wholeNumber(state.generation), step: wholeNumber(state.step) ?? 0 };
    this.follows = this.asked.generation === null;
    this.player = new Player((time) => this.draw(time));
    this.player.setSpeed(Number(state.speed) || SPEED);
    this.figure = new WorldFigure("World of the generation shown", "live-canvas", {
      invalidate: () => this.player.invalidate(),
      picked: (agent) => this.picked(agent),
    });
    this.figure.agent = wholeNumber(state.agent);
    this.bar = new TimeBar(this.player, "live", () => this.hold());
    this.legend = new Legend();
    this.inspector = new Inspector({
      open: (source, agent) => this.openKin(source, agent),
      close: () => this.figure.pick(null),
      seek: (step) => (step === null ? this.player.invalidate() : this.goTo(step)),
      turned: () => this.remember(),
    });
    this.inspector.turn(state.inside === "ancestors");
    this.element = this.build(runs);
    this.player.changed = () => this.changed();
  }

  build(runs) {
    this.title = el(
      "h2",
      { class: "number", "data-testid": "live-caption" },
      "Simulating the first generation …",
    );
    const newest = "Follow the newest generation";
    this.newest = el(
      "button",
      {
        type: "button",
        "aria-pressed": this.follows,
        title: newest,
        "data-testid": "live-newest",
        onclick: () => this.follow(),
      },
      "Newest",
    );
    this.open = el(
      "a",
      { class: "button quiet", hidden: true, "data-testid": "live-open-world" },
      "Open in World",
    ); // once the run is kept
    this.picker = runPicker(runs, this.run, (run) => {
      this.run = run;
      if (this.generation !== null) this.load(this.generation);
    });
    const { stage, foot } = this.figure;
    stage.classList.add("scrolls");
    stage.addEventListener("wheel", (event) => this.letScroll(event), { capture: true });
    const element = el(
      "section",
      { class: "card live-world", "aria-label": "World" },
      el(
        "div",
        { class: "row" },
        this.title,
        this.newest,
        el("span", { class: "spread" }),
        this.picker,
        this.open,
      ),
      stage,
      foot,
      this.legend.root,
      this.inspector.root,
      this.bar.root,
    );
    element.addEventListener("keydown", (event) => this.key(event));
    return element;
  }

  /** So many generations have lived. */
  offer(lived) {
    this.lived = lived;
    if (!lived || this.coming) return;
    if (this.generation === null)
      this.load(Math.min(this.asked.generation ?? lived - 1, lived - 1), this.asked.step);
    else this.next();
  }

  /** The newest generation, where that is what the reader wants, and the one before has been seen. */
  next() {
    if (!this.follows || this.coming || this.waiting || this.lived - 1 <= this.generation) return;
    const early = this.since + HOLD - performance.now();
    if (early <= 0) return this.load(this.lived - 1);
    this.waiting = setTimeout(() => {
      this.waiting = 0;
      this.next();
    }, early);
  }

  follow() {
    this.follows = true;
    this.figure.pick(null);
    this.remember();
    this.next();
    this.player.play();
  }

  /** The reader looks closer: no other generation comes in between. */
  hold() {
    if (!this.follows) return;
    this.follows = false;
    this.remember();
  }

  /** Show a generation for the reader, of the run that is shown or of another. */
  pick(generation, run = this.run) {
    this.follows = false;
    this.run = run;
    if (this.picker) this.picker.value = String(run);
    this.load(generation, 0);
  }

  /** Show a generation, from a step on, once it is there; where none is given, time goes on. */
  load(generation, step = null) {
    this.coming?.close();
    const source = { live: this.id, run: this.run, generation };
    const life = new Lifetime(
      async (part, signal) =>
        new Recording(
          await getBinary(`/api/recording?${new URLSearchParams({ ...source, ...part })}`, signal),
        ),
      () => (life === this.coming ? this.begin(life, source, step) : this.player.invalidate()),
      (fault) => message(fault.message, "error"),
    );
    this.coming = life;
  }

  begin(life, source, step) {
    this.coming = null;
    if (!life.length) return;
    const first = this.generation === null;
    this.life?.close();
    Object.assign(this, { life, source, generation: source.generation, since: performance.now() });
    this.share ??= mountShare(document.getElementById("actions"), () => this.shared());
    this.title.textContent = `Generation ${source.generation.toLocaleString("en")}`;
    this.figure.show(life);
    this.legend.show([life.header.look]);
    this.player.last = life.steps - 1;
    this.player.seek(step ?? (this.player.time < this.player.last ? this.player.time : 0));
    const still = matchMedia("(prefers-reduced-motion: reduce)").matches;
    if (first && this.follows && !still) this.player.play();
    this.inspect();
    this.remember();
    this.next();
  }

  picked(agent) {
    if (agent !== null) this.hold();
    this.inspect();
    this.remember();
  }

  inspect() {
    const { agent } = this.figure;
    if (agent === null || !this.source) this.inspector.hide();
    else this.inspector.show(this.source, agent);
  }

  /** The life of a parent or a child, in the generation before or after. */
  openKin({ generation }, agent) {
    this.follows = false;
    this.figure.agent = agent;
    this.load(generation, 0);
  }

  goTo(step) {
    this.hold();
    this.player.seek(step);
  }

  /** The player has been started, stopped or moved. What is newest plays again and again until something newer comes. */
  changed() {
    const { player } = this;
    this.bar.showTime();
    if (
      this.follows &&
      this.life &&
      !player.playing &&
      player.last > 0 &&
      player.time >= player.last
    )
      player.play();
    else this.remember();
  }

  /** The address holds which world is shown, and where time stands in it. */
  remember() {
    this.newest.setAttribute("aria-pressed", this.follows);
    if (this.generation === null) return;
    const { generation, run, player, figure } = this;
    const place = this.follows
      ? { generation: null, step: null }
      : { generation, step: Math.floor(player.time) };
    const inside = this.inspector.descent ? "ancestors" : null;
    this.navigate({
      ...place,
      run: run || null,
      agent: figure.agent,
      inside,
      speed: player.speed === SPEED ? null : player.speed,
    });
    this.open.hidden = !this.kept;
    this.open.href = `#/world?${new URLSearchParams({ ...this.kept, run, generation })}`;
  }

  /** What the share menu takes along. */
  shared() {
    return {
      panels: [{ source: String(query(this.source)), canvas: this.figure.canvas }],
      step: Math.floor(this.player.time),
    };
  }

  /** The run is kept as a study: from there, the World tab shows more of what is seen here. */
  keptAs(study, condition) {
    this.kept = { study, condition };
    this.remember();
  }

  draw(time) {
    const { there, ready } = this.figure.draw(time);
    if (!ready) this.player.invalidate();
    if (!this.life) return there;
    const step = Math.floor(time);
    this.bar.draw(step, this.life.steps, [{ life: this.life, chosen: this.figure.agent }]);
    this.inspector.draw(step);
    if (this.player.playing && !this.follows) this.remember();
    return there;
  }

  /** The keys of the World tab, where the focus is in here. */
  key(event) {
    if (event.key === "Escape" && this.figure.agent !== null) this.figure.pick(null);
    else if (this.life) this.bar.steer(event);
  }

  /** The wheel scrolls the page; over a map that is larger than its box, or with ctrl, as a trackpad's pinch is told, it zooms. */
  letScroll(event) {
    if (!event.ctrlKey && this.figure.view.camera.zoom === 1) event.stopPropagation();
  }

  close() {
    clearTimeout(this.waiting);
    this.share?.close();
    this.figure.close();
    this.inspector.hide();
    this.player.close();
    this.coming?.close();
    this.coming = null; // what has come in the meantime begins nothing any longer
    this.life?.close();
  }
}

/** Which of several runs is shown; null where there is but one. @param {(run: number) => void} chosen */
export function runPicker(runs, run, chosen) {
  if (runs === 1) return null;
  const options = Array.from({ length: runs }, (_, number) =>
    el("option", { value: number }, `run ${number}`),
  );
  const picker = el(
    "select",
    { "aria-label": "Run shown", "data-testid": "live-run" },
    ...options,
  );
  picker.value = String(run);
  picker.addEventListener("change", () => chosen(Number(picker.value)));
  return picker;
}

/** A whole number in an address, or null. */
export function wholeNumber(text) {
  return /^\d+$/.test(text ?? "") ? Number(text) : null;
}
