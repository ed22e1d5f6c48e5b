/** A run on the World tab of a model without a world: generation, agent and view. */

import { createFreezerButton } from "./freezer_button.js";
import { LifetimeSelector, setOptions } from "./lifetime_selector.js";
import { createQuery, el } from "../core/common.js";
import { ModelDisplay } from "./model_display.js";

const ALLELES = "alleles";

export class ModelPanel extends LifetimeSelector {
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
    const freezerButton = createFreezerButton(
      "Keep this population",
      "keep-a",
      () => ({ source: this.source }),
    );
    // A narrow window has no space for it.
    freezerButton?.classList.add("wide");
    if (freezerButton) this.pickers.append(freezerButton);
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
