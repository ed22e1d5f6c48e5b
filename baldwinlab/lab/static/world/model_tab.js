/** The World tab of models without a world: alleles and views of each generation. */

import { el, showMessage } from "../core/common.js";
import { handleGenerationKey } from "./shortcuts.js";
import { ModelPanel } from "./model_panel.js";
import { findNearestLifetime, formatLifetimeTitle } from "../core/sources.js";
import { CURVE, VIEWS } from "../core/guide.js";
import { GenerationPlayer } from "./player.js";

// Milliseconds that a generation is shown during playback.
const DISPLAY_TIME = 200;
// Of a study that does not belong to a paper.
const DEFAULT_QUESTION = "What changes from one generation to the next?";

export class ModelTab {
  constructor(root, navigate, guide, /** @type {import("../core/sources.js").Stored} */ stored) {
    const { studies } = stored;
    this.root = root;
    this.navigate = navigate;
    this.guide = guide;
    this.studies = studies;
    this.timer = 0;
    this.panel = new ModelPanel(studies, {
      invalidate: () => requestAnimationFrame(() => this.panel.curve.draw()),
      chosen: () => this.remember(this.generationPlayer.isPlaying),
      shown: () => this.shown(),
      failed: (error) => this.failed(error),
      playAllClicked: () => this.generationPlayer.toggle(),
      moved: () => this.remember(),
    });
    const allGenerations = (last) =>
      Array.from({ length: last + 1 }, (_, generation) => generation);
    this.generationPlayer = new GenerationPlayer(
      {
        panel: () => this.panel,
        visit: (generation) => this.showGeneration(generation),
        changed: (isPlaying) => this.setPlaying(isPlaying),
      },
      allGenerations,
    );
    const { signal } = (this.leaving = new AbortController());
    matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => this.redraw(), {
      signal,
    });
    addEventListener("keydown", (event) => this.panel.source && handleGenerationKey(event, this), {
      signal,
    });
  }

  start(state) {
    const worlds = el("div", { class: "worlds" }, this.panel.root);
    this.question = el("strong", { "data-testid": "question" });
    this.root.append(
      el("h1", { class: "visually-hidden" }, "World"),
      el("div", { class: "lead" }, this.question, this.guide.createDefinitionLink()),
      el("div", { class: "scene" }, worlds),
    );
    const { study, condition } = findNearestLifetime(this.studies, state);
    const { alleles } = this.studies
      .find(({ id }) => id === study)
      .conditions.find(({ name }) => name === condition);
    const isStill = matchMedia("(prefers-reduced-motion: reduce)").matches;
    // Without a generation, all generations play, if they differ visibly.
    const playsAll = state.generation === undefined && alleles.length > 0 && !isStill;
    this.show(playsAll ? { ...state, generation: 0 } : state);
    if (playsAll) this.generationPlayer.set(true);
  }

  /** Show the state of an address with a run. */
  show(state) {
    // If undefined, a lifetime plays from its beginning.
    this.startAt = state.step;
    this.panel.choose(findNearestLifetime(this.studies, state), {
      view: state.look,
      agent: state.agent ?? null,
    });
    const missing = this.panel.explainMissing(state);
    if (missing) showMessage(missing, "error");
    this.remember();
  }

  /**
   * Write the state to the address. Another generation is a new history entry, except during
   * playback.
   */
  remember(replace = true) {
    const { curve, source, views, view, agent, display } = this.panel;
    if (!source || curve.isDragging) return;
    this.navigate(
      {
        ...source,
        look: view.name === views[0].name ? null : view.name,
        agent,
        step: this.startAt ?? display.drawer?.step,
      },
      replace,
    );
  }

  /** Update the guide after the data has arrived. */
  shown() {
    const { source, view, display: { header, drawer } } = this.panel;
    if (drawer.bar) this.startPlayer(drawer.bar.player);
    this.startAt = undefined;
    const { question } = this.studies.find(({ id }) => id === source.study);
    this.question.textContent = question || DEFAULT_QUESTION;
    const shown = el("div", {}, el("p", {}, formatLifetimeTitle(source)), el("p", {}, CURVE));
    const viewTopics = header.view_description
      ? [{ title: view.name[0].toUpperCase() + view.name.slice(1), text: header.view_description }]
      : [];
    this.guide.setTexts(VIEWS[header.kind], [
      { title: "Shown here", text: shown },
      { title: "The model", text: header.description },
      ...viewTopics,
    ]);
    if (this.generationPlayer.isPlaying) this.scheduleNext();
  }

  /** Go to the step of the address. Without a step, the first lifetime starts to play. */
  startPlayer(player) {
    if (this.startAt !== undefined) player.seek(Number(this.startAt) || 0);
    else if (!this.watched) player.autoplay();
    this.watched = true;
  }

  failed(error) {
    this.generationPlayer.set(false);
    showMessage(error.message, "error");
  }

  redraw() {
    this.panel.callbacks.invalidate();
    this.panel.display.drawer?.bar?.player.invalidate();
  }

  showGeneration(generation) {
    if (generation === this.panel.source.generation) this.scheduleNext();
    else this.panel.goTo(generation);
  }

  scheduleNext() {
    clearTimeout(this.timer);
    this.timer = setTimeout(() => this.generationPlayer.next(), DISPLAY_TIME);
  }

  setPlaying(isPlaying) {
    clearTimeout(this.timer);
    this.panel.playButton.setAttribute("aria-pressed", isPlaying);
  }

  close() {
    this.leaving.abort();
    clearTimeout(this.timer);
    this.panel.close();
  }
}
