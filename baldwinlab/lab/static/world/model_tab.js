/** The World tab of models without a world: alleles and views of each generation of a run. */

import { createButton, createMenu, createQuery, el, showMessage } from "../core/common.js";
import { handleKey, listTimeActions } from "./time_bar.js";
import { findNearestLifetime, formatLifetimeTitle } from "../core/sources.js";
import { CURVE, VIEWS } from "../core/guide.js";
import { GenerationPlayer, LifetimeSelector, setOptions } from "./lifetime_selector.js";
import { ModelDisplay } from "./model_display.js";
import { openKeepDialog } from "../share/keep_dialog.js";

const ALLELES = "alleles";

/** The selectors and the display of a run: generation, agent and view. */
class ModelPanel extends LifetimeSelector {
  /**
   * @param {object[]} studies the readable studies of /api/studies
   * @param {{invalidate: () => void, chosen: () => void, shown: () => void, failed: (fault: Error)
   *   => void, playAllClicked: () => void, moved: () => void}} callbacks
   */
  constructor(studies, callbacks) {
    super("a", studies, callbacks);
    this.view = null;
    this.agent = null;
    const selectView = () => {
      this.choose(this.source, {
        view: this.viewList.value,
        agent: this.agents.value || null,
      });
      this.callbacks.chosen();
    };
    const createList = (label, testid) =>
      el("select", { "aria-label": label, "data-testid": testid, onchange: selectView });
    this.viewList = createList("View", "view-a");
    this.agents = createList("Agent", "agent-a");
    this.lists.run.closest("label").after(this.viewList, this.agents);
    const keepButton = createButton("Keep this population", () => openKeepDialog(this.source), {
      class: "quiet",
      "data-testid": "keep-a",
    });
    this.pickers.append(createMenu("Save", [keepButton], "saves-population"));
    this.display = new ModelDisplay((header) => this.formatTitle(header), callbacks.moved);
    this.root = el(
      "section",
      { class: "panel", "aria-label": "Genomes and lifetimes" },
      this.pickers,
      this.display.root,
    );
    this.sized = new ResizeObserver(() => callbacks.invalidate());
    this.sized.observe(this.curve.root);
  }

  /** All views of the selected condition. */
  get views() {
    const { alleles, views } = this.condition;
    return [...(alleles.length ? [{ name: ALLELES, has_agent_choice: false }] : []), ...views];
  }

  /** Return a message if the address names an unknown view or agent, else "". */
  explainMissing({ look, agent }) {
    const { name, agents } = this.condition;
    if (look && look !== this.view.name)
      return (
        `${name} has no view ${look}. Available: ` +
        `${this.views.map((view) => view.name).join(", ")}.`
      );
    return agent && this.view.has_agent_choice && agent !== this.agent
      ? `${name} has no agent ${agent}: its agents are 0 to ${agents - 1}.`
      : "";
  }

  /**
   * Show a generation. The previous one stays visible until it is loaded.
   * @param {import("../core/sources.js").Source} source
   */
  async choose(source, { view, agent } = { view: this.view?.name, agent: this.agent }) {
    this.setSource(source);
    const { study, condition, run, generation } = source;
    this.view = this.views.find(({ name }) => name === view) ?? this.views[0];
    const isAgent = /^\d+$/.test(agent ?? "") && Number(agent) < this.condition.agents;
    this.agent = this.view.has_agent_choice && isAgent ? agent : null;
    this.showViewLists();
    const runQuery = { study, condition, run };
    const viewQuery = {
      ...runQuery,
      generation,
      view: this.view.name,
      ...(this.agent !== null && { agent: this.agent }),
    };
    const url = this.view.name === ALLELES
      ? `api/alleles?${createQuery(runQuery)}`
      : `api/view?${createQuery(viewQuery)}`;
    try {
      if (await this.display.load(url, generation)) this.callbacks.shown();
    } catch (error) {
      this.callbacks.failed(error);
    }
  }

  /** Return the title: view and agent. */
  formatTitle(/** @type {Object<string, any>} */ { agent }) {
    const suffix = agent === null
      ? ""
      : `, agent ${agent}${this.agent === null ? " (fittest)" : ""}`;
    return `${this.view.name[0].toUpperCase()}${this.view.name.slice(1)}${suffix}`;
  }

  showViewLists() {
    setOptions(
      this.viewList,
      this.views.map(({ name }) => [name, name]),
    );
    setOptions(this.agents, [
      ["", "fittest agent"],
      ...Array.from({ length: this.condition.agents }, (_, agent) => [agent, `agent ${agent}`]),
    ]);
    this.viewList.hidden = this.views.length < 2;
    this.agents.hidden = !this.view.has_agent_choice;
    Object.assign(this.viewList, { value: this.view.name });
    Object.assign(this.agents, { value: this.agent ?? "" });
  }

  close() {
    this.sized.disconnect();
    this.curve.close();
    this.display.close();
    this.root.remove();
  }
}

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
    addEventListener("keydown", (event) => this.panel.source && this.handleKey(event), { signal });
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

  handleKey(event) {
    const { bar } = this.panel.display.drawer ?? {};
    handleKey(event, bar?.timeline.slider, {
      ...(bar && listTimeActions(event, bar.player, 10)),
      "[": () => this.panel.move(-1),
      "]": () => this.panel.move(1),
      g: () => this.generationPlayer.toggle(),
    });
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
