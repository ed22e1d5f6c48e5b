/** The World tab of genomes: the alleles of a generation, locus by locus, and the way through the generations. */

import { AllelePanel } from "./allele_panel.js";
import { el, message } from "./common.js";
import { steerGenerations } from "./keys.js";
import { nearest, requireShown, titled, withTypicalRun } from "./sources.js";
import { ALLELES, CURVE } from "./topics.js";
import { Tour } from "./tour.js";

const EVERY = 200; // ms that a generation is seen while they play

export class AllelesTab {
  /** @param {{studies: object[], worldless: object[]}} there as `watchable` finds them */
  constructor(root, navigate, guide, { studies, worldless }) {
    Object.assign(this, { root, navigate, guide, studies, worldless, turn: 0, timer: 0 });
    this.panel = new AllelePanel(studies, {
      invalidate: () => requestAnimationFrame(() => this.panel.curve.draw()),
      chosen: () => this.remember(this.tour.on),
      shown: () => this.explain(),
      failed: (fault) => this.failed(fault),
      toured: () => this.tour.toggle(),
    });
    const now = () => ({ generation: this.panel.source.generation, last: this.panel.condition.generations - 1 });
    const everyOne = (last) => Array.from({ length: last + 1 }, (_, generation) => generation);
    this.tour = new Tour({ now, visit: (generation) => this.visit(generation), changed: (on) => this.toured(on) }, everyOne);
    const { signal } = (this.leaving = new AbortController());
    matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => this.panel.tell.invalidate(), { signal });
    addEventListener("keydown", (event) => this.panel.source && steerGenerations(event, this), { signal });
  }

  start(state) {
    const worlds = el("div", { class: "worlds" }, this.panel.root);
    this.root.append(el("h1", { class: "visually-hidden" }, "World"), el("div", { class: "scene" }, worlds));
    return this.come(state);
  }

  /** Show what an address says, in the run to look at first where it names none. */
  async come(state) {
    const mine = ++this.turn;
    const whole = await withTypicalRun(this.studies, state);
    if (mine !== this.turn || this.leaving.signal.aborted) return;
    try {
      requireShown(this, whole);
      this.panel.choose(nearest(this.studies, whole, true));
    } catch (fault) {
      message(fault.message, "error");
      if (!this.panel.source) this.panel.choose(nearest(this.studies, { study: state.study, condition: state.condition }));
    }
    this.remember();
  }

  /** The address follows what is shown; another generation is a new place in the history, but not while they play. */
  remember(replace = true) {
    if (!this.panel.curve.held) this.navigate(this.panel.source, replace);
  }

  explain() {
    const { source, about } = this.panel;
    const shown = el("div", {}, el("p", {}, titled(source)), el("p", {}, CURVE));
    this.guide.tell([{ title: "Shown here", text: shown }, { title: "The model", text: about }, ...ALLELES]);
  }

  failed(fault) {
    this.tour.set(false);
    message(fault.message, "error");
  }

  /** So many generations on or, below 0, back. */
  goOn(by) {
    this.panel.goTo(this.panel.source.generation + by);
  }

  visit(generation) {
    this.panel.goTo(generation);
    this.timer = setTimeout(() => this.tour.next(), EVERY);
  }

  toured(on) {
    clearTimeout(this.timer);
    this.panel.tour.setAttribute("aria-pressed", on);
  }

  close() {
    this.leaving.abort();
    clearTimeout(this.timer);
    this.panel.close();
  }
}
