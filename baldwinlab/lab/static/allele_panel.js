/** One run on the World tab whose genomes are shown: which generation, and its alleles, locus by locus. */

import { AlleleBars } from "./allele_bars.js";
import { Chooser } from "./chooser.js";
import { el, getBinary } from "./common.js";

export class AllelePanel extends Chooser {
  /**
   * @param {object[]} studies as /api/studies lists them, without those that cannot be read
   * @param {{invalidate: () => void, chosen: () => void, shown: () => void, failed: (fault: Error) => void, toured: () => void}} tell
   */
  constructor(studies, tell) {
    super("a", studies, tell);
    this.about = "";
    this.bars = new AlleleBars();
    this.root = el("section", { class: "panel", "aria-label": "Alleles" }, this.pickers, this.bars.root);
    this.sized = new ResizeObserver(() => tell.invalidate());
    this.sized.observe(this.curve.root);
  }

  /** Show a generation; the bars of another run stay in sight until its own are there. @param {import("./sources.js").Source} source */
  async choose(source) {
    if (!super.choose(source)) return;
    const { study, condition, run } = source;
    const asked = String(new URLSearchParams({ study, condition, run }));
    if (asked === this.asked) return this.show();
    this.stop?.abort();
    Object.assign(this, { asked, share: null, stop: new AbortController() });
    delete this.root.dataset.ready;
    try {
      const { header, arrays } = await getBinary(`api/alleles?${asked}`, this.stop.signal);
      Object.assign(this, { share: arrays.share, about: header.about });
      this.bars.begin(header.alleles, header.arrays[0].shape[1]);
      this.root.dataset.ready = "";
      this.show();
    } catch (fault) {
      if (fault.name === "AbortError") return;
      this.asked = null; // it may be there when it is chosen again
      this.bars.clear(); // what is named in the pickers is not there, and nothing else must seem to be it
      this.tell.failed(fault);
    }
  }

  /** The bars of the generation that is chosen, once they are there. */
  show() {
    if (!this.share) return;
    this.bars.show(this.source.generation, this.share);
    this.tell.shown();
  }

  close() {
    this.sized.disconnect();
    this.curve.close();
    this.stop?.abort();
    this.root.remove();
  }
}
