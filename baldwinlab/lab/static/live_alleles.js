/** The alleles of a live run of a model without a world: newest or selected generation. */

import { AlleleBars } from "./allele_bars.js";
import { createQuery, el, getBinary, showMessage } from "./common.js";
import {
  createNewestButton,
  createRunPicker,
  createWorldLink,
  parseWholeNumber,
} from "./run_picker.js";

export class LiveAlleles {
  /**
   * @param {string} id of the live run
   * @param {number} runs
   * @param {Object<string, string>} state of the address: run and generation, by default the newest
   * @param {(patch: Object<string, any>) => void} navigate
   */
  constructor(id, runs, state, navigate) {
    this.id = id;
    this.navigate = navigate;
    this.generationsDone = 0;
    this.requestedUrl = "";
    this.isLoading = false;
    this.savedStudy = null;
    this.stop = new AbortController();
    this.run = Math.min(parseWholeNumber(state.run) ?? 0, runs - 1);
    this.picked = parseWholeNumber(state.generation);
    this.bars = new AlleleBars();
    this.newest = createNewestButton(this.picked === null, () => this.pick(null));
    this.open = createWorldLink();
    this.picker = createRunPicker(runs, this.run, (run) => this.pick(this.picked, run));
    this.element = el(
      "section",
      { class: "card live-alleles", "aria-label": "Genomes", "data-testid": "live-alleles" },
      el(
        "div",
        { class: "row" },
        this.newest,
        el("span", { class: "spread" }),
        this.picker,
        this.open,
      ),
      this.bars.root,
    );
    this.showState();
  }

  get generation() {
    return Math.min(this.picked ?? Infinity, this.generationsDone - 1);
  }

  /** Set the number of finished generations. */
  setGenerationsDone(generationsDone) {
    this.generationsDone = generationsDone;
    this.load();
  }

  /** Show a generation of a run, or the newest one (null). */
  pick(generation, run = this.run) {
    this.picked = generation;
    this.run = run;
    if (this.picker) this.picker.value = String(run);
    this.navigate({ generation, run: run || null });
    this.showState();
    this.load();
  }

  /** Load the current generation. Only one request is active at a time. */
  async load() {
    const { id, run, generation } = this;
    const url = `api/alleles?${createQuery({ live: id, run, generation })}`;
    if (this.isLoading || generation < 0 || url === this.requestedUrl) return;
    this.requestedUrl = url;
    this.isLoading = true;
    try {
      const { header, arrays } = await getBinary(url, this.stop.signal);
      this.bars.setData(header, arrays);
      this.bars.show(generation);
    } catch (error) {
      if (error.name === "AbortError") return;
      showMessage(error.message, "error");
    }
    this.isLoading = false;
    this.showState();
    this.load();
  }

  showState() {
    this.newest.setAttribute("aria-pressed", String(this.picked === null));
    this.open.hidden = !this.savedStudy;
    const { savedStudy, run, generation } = this;
    this.open.href = `#/world?${createQuery({ ...savedStudy, run, generation })}`;
  }

  /** Set the study that the run was saved as. The World tab can then show it. */
  setSaved(study, condition) {
    this.savedStudy = { study, condition };
    this.showState();
  }

  close() {
    this.stop.abort();
  }
}
