/** One world on the World tab: which life is shown, and the canvas it is drawn on. */

import { el, getBinary, icon } from "./common.js";
import { listen } from "./gestures.js";
import { named } from "./population.js";
import { Lifetime, Recording } from "./recording.js";
import { RunCurve } from "./run_curve.js";
import { PRESETS, nearest, query } from "./sources.js";
import { Tip } from "./tip.js";
import { WorldView } from "./world.js";

const TOUR = "Play one generation after the other (g)";
const PART = 1_300_000; // agent-steps fetched at once, about 17 MB

export class Panel {
  /**
   * @param {string} name "a" or "b"
   * @param {object[]} studies as /api/studies lists them, without those that cannot be read
   * @param {{invalidate: () => void, chosen: () => void, loaded: () => void, failed: (fault: Error) => void,
   *   picked: (agent: number|null) => void, moved: () => void, fitted: () => void, toured: () => void}} tell
   */
  constructor(name, studies, tell) {
    Object.assign(this, { name, studies, tell, life: null, source: null });
    this.canvas = el("canvas", { tabindex: 0, role: "img", "data-testid": `world-${name}`, "aria-label": "The world" });
    this.busy = el("div", { class: "busy", hidden: true }, "Living it again …");
    this.note = el("div", { class: "count number", "data-testid": `eaten-${name}` });
    this.stage = el("div", { class: "stage" }, this.canvas, this.busy);
    this.root = el(
      "section",
      { class: "panel", "aria-label": name === "a" ? "World" : "World beside it" },
      this.makePickers(),
      this.stage,
    );
    this.view = new WorldView(this.canvas);
    this.tip = new Tip(this.stage);
    const hovered = (agent, x, y) => this.tip.show(agent === null || !this.seen ? null : this.seen(agent), x, y);
    listen(this.canvas, this.view, { changed: tell.moved, picked: tell.picked, fitted: tell.fitted, hovered });
    this.sized = new ResizeObserver(() => {
      this.view.resize();
      tell.invalidate();
    });
    this.sized.observe(this.stage);
  }

  makePickers() {
    const select = (label, key) =>
      el("select", { "aria-label": label, "data-testid": `${key}-${this.name}`, onchange: () => this.pickedFromLists(key) });
    this.lists = { study: select("Study", "study"), condition: select("Condition", "condition"), run: select("Run", "run") };
    const titled = this.studies.map(({ id }) =>
      el("option", { value: id }, id === PRESETS ? "presets (nothing stored)" : id === "." ? "this study" : id),
    );
    this.lists.study.append(...titled);
    this.number = el("input", {
      type: "number",
      min: 0,
      step: 1,
      "aria-label": "Generation",
      class: "generation-number",
      "data-testid": `generation-${this.name}`,
      onchange: () => this.goTo(Number(this.number.value)),
    });
    const { invalidate, chosen: settled } = this.tell;
    this.curve = new RunCurve({ go: (generation) => this.goTo(generation), settled, invalidate });
    const by = (way, path, label) =>
      el(
        "button",
        {
          type: "button",
          class: "quiet square",
          "aria-label": label,
          title: label,
          onclick: () => this.goTo(this.source.generation + way),
        },
        icon(path),
      );
    const touring = { type: "button", class: "quiet square", "data-testid": `tour-${this.name}`, "aria-pressed": "false", onclick: this.tell.toured };
    this.tour = el("button", { ...touring, title: TOUR, "aria-label": TOUR }, icon("M3 5l6 5-6 5zM10 5l6 5-6 5z"));
    return el(
      "div",
      { class: "pickers" },
      this.lists.study,
      this.lists.condition,
      el("label", { class: "inline" }, el("span", { class: "soft" }, "run"), this.lists.run),
      el(
        "div",
        { class: "generation" },
        el("span", { class: "soft" }, "generation"),
        by(-1, "M12 5l-5 5 5 5", "Generation before ( [ )"),
        this.number,
        by(1, "M8 5l5 5-5 5", "Next generation ( ] )"),
        this.tour,
        this.curve.root,
      ),
      this.note,
    );
  }

  get conditions() {
    return this.studies.find(({ id }) => id === this.source?.study)?.conditions ?? [];
  }

  get condition() {
    return this.conditions.find(({ name }) => name === this.source.condition);
  }

  /** Another study or condition keeps what of the rest is there in it as well. */
  pickedFromLists(changed) {
    const wanted = { ...this.source, study: this.lists.study.value };
    if (changed !== "study") wanted.condition = this.lists.condition.value;
    if (changed === "run") wanted.run = Number(this.lists.run.value);
    this.choose(nearest(this.studies, wanted));
    this.tell.chosen();
  }

  goTo(generation) {
    const last = (this.condition?.generations ?? 1) - 1;
    const within = Math.min(Math.max(0, Math.round(generation) || 0), last);
    if (within === this.source.generation) return this.showSource();
    this.choose({ ...this.source, generation: within });
    this.tell.chosen();
  }

  /** Show a life; the one before stays in sight until it is there. @param {import("./sources.js").Source} source */
  choose(source) {
    if (this.source && String(query(source)) === String(query(this.source))) return;
    this.source = source;
    this.showSource();
    this.coming?.close();
    const agents = this.condition?.agents;
    const started = performance.now();
    this.coming = new Lifetime(
      (part, signal) => this.fetchPart(source, part, agents, signal),
      () => {
        if (this.coming?.parts.size) {
          this.life?.close();
          [this.life, this.coming] = [this.coming, null];
          this.root.dataset.ready = String(Math.round(performance.now() - started)); // ms, for tests and benchmarks
          this.tell.loaded();
        }
        this.busy.hidden = !this.coming;
        this.tell.invalidate();
      },
      (fault) => {
        this.life?.close(); // what is named in the pickers is not there, and nothing else must seem to be it
        this.life = this.coming = null;
        this.note.textContent = "";
        delete this.root.dataset.ready;
        this.busy.hidden = true;
        this.tell.failed(fault);
      },
    );
    setTimeout(() => (this.busy.hidden = !this.coming), 150);
  }

  async fetchPart(source, part, agents, signal) {
    const asked = query(source);
    const steps = this.condition?.steps;
    const span = part ?? (agents && steps ? { first: 0, last: Math.min(steps, Math.max(100, Math.floor(PART / agents))) } : null);
    if (span) for (const [key, value] of Object.entries(span)) asked.set(key, value);
    return new Recording(await getBinary(`api/recording?${asked}`, signal));
  }

  showSource() {
    const { study, condition, run, generation } = this.source;
    const options = (list, values) => {
      const same = list.options.length === values.length && values.every((value, at) => list.options[at].value === String(value));
      if (!same) list.replaceChildren(...values.map((value) => el("option", { value }, value)));
    };
    this.lists.study.hidden = this.studies.length < 2;
    options(
      this.lists.condition,
      this.conditions.map(({ name }) => name),
    );
    options(this.lists.run, this.condition?.runs ?? []);
    Object.assign(this.lists.study, { value: study });
    Object.assign(this.lists.condition, { value: condition });
    Object.assign(this.lists.run, { value: String(run) });
    const last = (this.condition?.generations ?? 1) - 1;
    Object.assign(this.number, { max: last, value: generation });
    this.curve.follow(this.source, last);
  }

  /** @returns {{there: boolean, ready: boolean}} whether the moment has come from the server, and whether all of it is drawn */
  draw(time, look) {
    const recording = this.life?.at(Math.floor(time)) ?? null;
    const moment = recording ? Math.min(time, recording.steps - 1) : 0;
    const ready = this.view.draw(recording, moment, look);
    this.curve.draw();
    if (recording) this.showCount(recording, Math.floor(moment));
    return { there: recording !== null || !this.life, ready };
  }

  showCount(recording, step) {
    this.seen = (agent) => named(agent, recording.eatenBefore(step + 1, agent));
    const text = recording.eaten(step + 1);
    if (this.note.textContent !== text) this.note.textContent = text;
  }

  close() {
    this.sized.disconnect();
    this.curve.close();
    this.life?.close();
    this.coming?.close();
    this.root.remove();
  }
}
