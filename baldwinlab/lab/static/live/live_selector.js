/** The alleles of a live run, and the controls that select a generation and a run. */

import { createButton, createQuery, createSelect, el, showMessage } from "../core/common.js";
import { ModelDisplay } from "../world/model_display.js";

export class LiveSelector {
  /**
   * @param {string} id of the live run
   * @param {number} runs
   * @param {Object<string, string>} state of the address: run, and generation, by default the newest
   * @param {(generation: number|null, run: number) => void} picked called when the user selects a
   *   run or the newest generation (null)
   */
  constructor(id, runs, state, picked) {
    this.id = id;
    this.generationsDone = 0;
    this.run = Math.min(parseWholeNumber(state.run) ?? 0, runs - 1);
    // null follows the newest generation.
    this.picked = parseWholeNumber(state.generation);
    this.savedStudy = null;
    this.newest = createButton("Newest", () => picked(null, this.run), {
      title: "Follow the newest generation",
      "data-testid": "live-newest",
    });
    const options = Array.from({ length: runs }, (_, run) => [run, `run ${run}`]);
    this.runs = createSelect(options, this.run, (run) => picked(this.picked, Number(run)), {
      "aria-label": "Run shown",
      "data-testid": "live-run",
      hidden: runs === 1,
    });
    // Visible after the run is saved.
    this.link = el(
      "a",
      { class: "button quiet", hidden: true, "data-testid": "live-open-world" },
      "Open in World",
    );
    this.update();
  }

  get followsNewest() {
    return this.picked === null;
  }

  /** The selected lifetime. Its generation is -1 before the first one is finished. */
  get source() {
    const generation = Math.min(this.picked ?? Infinity, this.generationsDone - 1);
    return { live: this.id, run: this.run, generation };
  }

  /** Select a generation of a run, or follow the newest one (null). */
  select(generation, run = this.run) {
    this.picked = generation;
    this.run = run;
    this.runs.value = String(run);
    this.update();
  }

  /** Set the study that the run was saved as. The World tab can then show it. */
  setSaved(study, condition) {
    this.savedStudy = { study, condition };
    this.update();
  }

  update() {
    this.newest.setAttribute("aria-pressed", String(this.followsNewest));
    this.link.hidden = !this.savedStudy;
    const { run, generation } = this.source;
    this.link.href = `#/world?${createQuery({ ...this.savedStudy, run, generation })}`;
  }
}

/** Return a whole number of an address, or null. */
export function parseWholeNumber(text) {
  return /^\d+$/.test(text ?? "") ? Number(text) : null;
}

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
