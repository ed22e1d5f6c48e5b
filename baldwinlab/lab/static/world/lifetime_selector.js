/**
 * The controls that select a lifetime: study, condition and run as lists, and the generation
 * slider.
 */

import {
  createIconButton,
  createOptions,
  createQuery,
  el,
  formatNumber,
  getJSON,
} from "../core/common.js";
import {
  createLifetimeQuery,
  findNearestLifetime,
  formatLifetimeAddress,
  hasWorld,
  PRESETS,
} from "../core/sources.js";
import { ChartSlider } from "../charts/chart_slider.js";
import { computeRange } from "../core/drawing.js";
import { palette } from "../core/palette.js";

// The names of studies with a special id.
const STUDY_NAMES = { [PRESETS]: "built-in presets", ".": "this study" };
const PLAY_ALL_ICON = "M3 5l6 5-6 5zM10 5l6 5-6 5z";
const PLAY_ALL = "Play the generations one after another (g)";

export class LifetimeSelector {
  /**
   * @param {string} name "a" or "b"
   * @param {object[]} studies the readable studies of /api/studies
   * @param {Object<string, (...values: any[]) => void>} callbacks `invalidate`, `chosen` and
   *   `playAllClicked`, and those of the subclass
   */
  constructor(name, studies, callbacks) {
    this.name = name;
    this.studies = studies;
    this.callbacks = callbacks;
    this.source = null;
    this.pickers = this.buildControls();
  }

  buildControls() {
    this.lists = {
      study: this.createList("Study", "study"),
      condition: this.createList("Condition", "condition"),
      run: this.createList("Run", "run"),
    };
    const names = this.studies.map(({ id }) => [id, STUDY_NAMES[id] ?? id]);
    this.lists.study.append(...createOptions(names));
    return el(
      "div",
      { class: "pickers" },
      this.lists.study,
      this.lists.condition,
      el("label", { class: "inline" }, el("span", { class: "soft" }, "run"), this.lists.run),
      this.createGenerationControls(),
    );
  }

  createList(label, key) {
    return el("select", {
      "aria-label": label,
      "data-testid": `${key}-${this.name}`,
      onchange: () => this.selectFromLists(key),
    });
  }

  /** Return the number of the generation, its buttons, and the slider. */
  createGenerationControls() {
    this.number = el("input", {
      type: "number",
      min: 0,
      step: 1,
      "aria-label": "Generation",
      class: "generation-number",
      "data-testid": `generation-${this.name}`,
      onchange: () => this.goTo(Number(this.number.value)),
    });
    const { invalidate, chosen: settled, playAllClicked } = this.callbacks;
    this.curve = new RunCurve({ go: (generation) => this.goTo(generation), settled, invalidate });
    this.playButton = createIconButton(PLAY_ALL, PLAY_ALL_ICON, playAllClicked, {
      "data-testid": `play-all-${this.name}`,
      "aria-pressed": "false",
    });
    return el(
      "div",
      { class: "generation" },
      el("span", { class: "soft" }, "generation"),
      el(
        "span",
        { class: "generation-steps" },
        createIconButton("Previous generation ( [ )", "M12 5l-5 5 5 5", () => this.move(-1)),
        this.number,
        createIconButton("Next generation ( ] )", "M8 5l5 5-5 5", () => this.move(1)),
        this.playButton,
      ),
      this.curve.root,
    );
  }

  get conditions() {
    return this.studies.find(({ id }) => id === this.source?.study)?.conditions ?? [];
  }

  get condition() {
    return this.conditions.find(({ name }) => name === this.source.condition);
  }

  /**
   * Keep run and generation if the new study or condition has them.
   *
   * A source for the other tab (with or without a world) is opened by its address.
   */
  selectFromLists(changed) {
    const requested = { ...this.source, study: this.lists.study.value };
    if (changed !== "study") requested.condition = this.lists.condition.value;
    if (changed === "run") requested.run = Number(this.lists.run.value);
    const source = findNearestLifetime(this.studies, requested);
    if (hasWorld(this.studies, source) !== hasWorld(this.studies, this.source))
      return void (location.hash = formatLifetimeAddress(source));
    this.choose(source);
    this.callbacks.chosen();
  }

  goTo(generation) {
    const last = (this.condition?.generations ?? 1) - 1;
    const target = Math.min(Math.max(0, Math.round(generation) || 0), last);
    if (target === this.source.generation) return this.showSource();
    this.choose({ ...this.source, generation: target });
    this.callbacks.chosen();
  }

  /** Move by some generations. Negative numbers move back. */
  move(offset) {
    this.goTo(this.source.generation + offset);
  }

  /**
   * Show a lifetime. Subclasses load it.
   * @param {import("../core/sources.js").Source} _source
   * @returns {void|Promise<void>}
   */
  choose(_source) {}

  /**
   * Set the source, and return whether it has changed.
   * @param {import("../core/sources.js").Source} source
   * @returns {boolean}
   */
  setSource(source) {
    if (
      this.source &&
      String(createLifetimeQuery(source)) === String(createLifetimeQuery(this.source))
    )
      return false;
    this.source = source;
    this.showSource();
    return true;
  }

  showSource() {
    const { study, condition, run, generation } = this.source;
    this.lists.study.hidden = this.studies.length < 2;
    setOptions(
      this.lists.condition,
      this.conditions.map(({ name, title }) => [name, title]),
    );
    setOptions(this.lists.run, this.condition?.runs.map((stored) => [stored, stored]) ?? []);
    Object.assign(this.lists.study, { value: study });
    Object.assign(this.lists.condition, { value: condition });
    Object.assign(this.lists.run, { value: String(run) });
    const last = (this.condition?.generations ?? 1) - 1;
    Object.assign(this.number, { max: last, value: generation });
    this.curve.setSource(this.source, last);
  }
}

/** Set the options of a list, pairs of a value and a text. Equal options are not replaced. */
export function setOptions(list, options) {
  const hasSameOptions = list.options.length === options.length &&
    options.every(
      ([value, text], index) =>
        list.options[index].value === String(value) && list.options[index].text === String(text),
    );
  if (!hasSameOptions) list.replaceChildren(...createOptions(options));
}

/** @typedef {{measure: string, best: number[], mean: number[]}} Curve */

class RunCurve extends ChartSlider {
  /**
   * @param {{go: (generation: number) => void, settled: () => void, invalidate: () => void}}
   *   callbacks `settled` is called after dragging
   */
  constructor({ go, settled, invalidate }) {
    super("run-curve plain", { "aria-label": "Generation" });
    this.invalidate = invalidate;
    this.isDragging = false;
    this.requested = null;
    this.curve = null;
    this.stop = null;
    this.slider.addEventListener("input", () => {
      // Intermediate generations are not history entries.
      this.isDragging = true;
      go(this.slider.valueAsNumber);
    });
    const endDrag = () => {
      if (!this.isDragging) return;
      this.isDragging = false;
      settled();
    };
    for (const end of ["change", "pointerup", "pointercancel"])
      this.slider.addEventListener(end, endDrag);
  }

  /**
   * Set the generation of a run. A run that is not stored has no curve.
   * @param {import("../core/sources.js").Source} source
   */
  async setSource({ study, condition, run, generation }, last) {
    this.setLast(last);
    this.show(generation);
    const requested = study === PRESETS ? null : String(createQuery({ study, condition, run }));
    if (requested === this.requested) return this.updateValueText();
    this.close();
    // The old curve stays visible until the new one is loaded.
    this.requested = requested;
    this.curve = null;
    try {
      this.setCurve(requested && (await getJSON(`api/run?${requested}`, this.stop.signal)));
    } catch (error) {
      // The request of the lifetime reports the error.
      if (error.name !== "AbortError") this.setCurve(null);
    }
  }

  /** @param {Curve|null} curve */
  setCurve(curve) {
    this.curve = curve;
    this.root.classList.toggle("plain", !curve);
    this.updateValueText();
    this.invalidate();
  }

  close() {
    this.stop?.abort();
    this.stop = new AbortController();
  }

  updateValueText() {
    if (this.curve)
      this.slider.setAttribute("aria-valuetext", this.describe(this.slider.valueAsNumber));
    else this.slider.removeAttribute("aria-valuetext");
  }

  describeAt(share) {
    const last = Number(this.slider.max);
    return this.curve && this.describe(Math.round(Math.min(1, Math.max(0, share)) * last));
  }

  describe(generation) {
    const { measure, best, mean } = this.curve;
    return (
      `generation ${formatNumber(generation)}, ${measure}: best ` +
      `${formatNumber(best[generation])}, average ${formatNumber(mean[generation])}`
    );
  }

  /** Draw the average agent as an area and the best agent as a line, if something has changed. */
  draw() {
    const sheet = this.curve && this.redrawIfChanged(this.curve);
    if (!sheet) return;
    const { pen, width, height, pixelRatio } = sheet;
    const { best, mean } = this.curve;
    const [low, high] = computeRange(best, mean);
    const x = (generation) => (best.length > 1 ? generation / (best.length - 1) : 0.5) * width;
    const y = (value) => (height - pixelRatio) * (high - value) / (high - low) + pixelRatio / 2;
    pen.fillStyle = palette.edge;
    pen.globalAlpha = 0.6;
    pen.fillRect(0, y(0) - pixelRatio / 2, width, pixelRatio);
    pen.fillStyle = pen.strokeStyle = palette.meal;
    pen.globalAlpha = 0.4;
    pen.beginPath();
    pen.moveTo(0, y(0));
    mean.forEach((value, generation) => pen.lineTo(x(generation), y(value)));
    pen.lineTo(width, y(0));
    pen.fill();
    pen.globalAlpha = 1;
    pen.lineWidth = 1.2 * pixelRatio;
    pen.lineJoin = "round";
    pen.beginPath();
    best.forEach((value, generation) => pen.lineTo(x(generation), y(value)));
    pen.stroke();
  }
}

// Changes are largest in early generations. The last generation is added.
const FIRST_STOPS = [0, 5, 20];

/** Play the lifetimes of selected generations one after another. */
export class GenerationPlayer {
  /**
   * @param {{panel: () => LifetimeSelector, visit: (generation:
   *   number) => void, changed: (isPlaying: boolean) => void}} callbacks
   * @param {(last: number) => number[]} stops the generations to show, up to the last
   */
  constructor(callbacks, stops = (last) => [...FIRST_STOPS, last]) {
    this.callbacks = callbacks;
    this.stops = stops;
    this.isPlaying = false;
  }

  toggle() {
    this.set(!this.isPlaying);
    if (this.isPlaying) this.callbacks.visit(0);
  }

  /** Continue after the end of a lifetime. */
  next() {
    if (!this.isPlaying) return;
    const { source: { generation }, condition } = this.callbacks.panel();
    const last = condition.generations - 1;
    const next = this.stops(last).find((stop) => stop > generation && stop <= last);
    if (next === undefined) this.set(false);
    else this.callbacks.visit(next);
  }

  set(isPlaying) {
    this.isPlaying = isPlaying;
    this.callbacks.changed(isPlaying);
  }
}
