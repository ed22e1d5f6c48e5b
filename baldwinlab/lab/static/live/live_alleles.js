/** The alleles of a live run of a model without a world: newest or selected generation. */

import { createQuery, el, showMessage } from "../core/common.js";
import { LiveSelector } from "./live_selector.js";
import { ModelDisplay } from "../world/model_display.js";

export class LiveAlleles {
  /**
   * @param {string} id of the live run
   * @param {number} runs
   * @param {Object<string, string>} state of the address: run and generation, by default the newest
   * @param {(patch: Object<string, any>) => void} navigate
   */
  constructor(id, runs, state, navigate) {
    this.navigate = navigate;
    this.isLoading = false;
    this.selector = new LiveSelector(
      id,
      runs,
      state,
      (generation, run) => this.showGeneration(generation, run),
    );
    this.display = new ModelDisplay(() => "");
    const { newest, runs: runList, link } = this.selector;
    this.element = el(
      "section",
      { class: "card live-alleles", "aria-label": "Genomes", "data-testid": "live-alleles" },
      el("div", { class: "row" }, newest, el("span", { class: "spread" }), runList, link),
      this.display.root,
    );
  }

  /** Set the number of finished generations. */
  setGenerationsDone(generationsDone) {
    this.selector.generationsDone = generationsDone;
    this.load();
  }

  /** Show a generation of a run, or the newest one (null). */
  showGeneration(generation, run) {
    this.selector.select(generation, run);
    this.navigate({ generation, run: this.selector.run || null });
    this.load();
  }

  /** Load the selected generation. Only one request is active at a time. */
  async load() {
    const { source } = this.selector;
    const url = `api/alleles?${createQuery(source)}`;
    if (this.isLoading || source.generation < 0 || url === this.display.requestedUrl) return;
    this.isLoading = true;
    await this.display.load(url, source.generation).catch((error) => {
      showMessage(error.message, "error");
    });
    this.isLoading = false;
    this.selector.update();
    this.load();
  }

  close() {
    this.display.close();
  }
}
