/** The display of a model without a world: it loads the data of a view, and shows a generation. */

import { AlleleBars } from "./allele_bars.js";
import { el, getBinary } from "../core/common.js";
import { GridView } from "./grid_view.js";
import { MatrixView } from "./matrix_view.js";
import { PathView } from "./path_view.js";

/**
 * @typedef {object} Drawer draws one kind of view
 * @property {HTMLElement} root
 * @property {(header: Object<string, any>, arrays: Object<string, ArrayLike<number>>, title:
 *   string) => void} setData
 * @property {(generation: number) => void} show
 * @property {() => void} clear
 * @property {() => void} [close]
 * @property {import("./time_bar.js").TimeBar} [bar] if the view has steps
 * @property {number} [step]
 */
const DRAWERS = { alleles: AlleleBars, matrix: MatrixView, path: PathView, grid: GridView };

export class ModelDisplay {
  /**
   * @param {(header: Object<string, any>) => string} formatTitle
   * @param {() => void} [moved] called when another step is shown
   */
  constructor(formatTitle, moved = () => {}) {
    this.formatTitle = formatTitle;
    this.moved = moved;
    this.root = el("div", { class: "model-view" });
    /** @type {Drawer|null} */
    this.drawer = null;
    this.header = null;
    this.requestedUrl = null;
    this.generation = 0;
  }

  /**
   * Show a generation of the data at an address. The previous data stay visible until they are
   * loaded.
   * @returns {Promise<boolean>} whether they are shown, unless a later request shows its data;
   *   rejects after an error
   */
  async load(url, generation) {
    this.generation = generation;
    if (url === this.requestedUrl) return this.show();
    this.stop?.abort();
    this.requestedUrl = url;
    this.header = null;
    delete this.root.dataset.ready;
    this.stop = new AbortController();
    try {
      this.setData(await getBinary(url, this.stop.signal));
    } catch (error) {
      if (error.name === "AbortError") return false;
      // Allow another attempt.
      this.requestedUrl = null;
      // Remove the old view, because the selectors show another source.
      this.drawer?.clear();
      throw error;
    }
    return this.show();
  }

  /** Show the requested generation, if the data are loaded. */
  show() {
    if (this.header) this.drawer.show(this.generation);
    return this.header !== null;
  }

  setData({ header, arrays }) {
    const Drawer = DRAWERS[header.kind];
    if (!(this.drawer instanceof Drawer)) {
      this.drawer?.close?.();
      this.drawer = new Drawer(this.moved);
      this.root.replaceChildren(this.drawer.root);
    }
    this.header = header;
    this.drawer.setData(header, arrays, this.formatTitle(header));
    this.root.dataset.ready = "";
  }

  close() {
    this.stop?.abort();
    this.drawer?.close?.();
  }
}
