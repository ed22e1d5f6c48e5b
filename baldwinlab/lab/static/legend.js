/** The legend of the marks on a map. */

import { el } from "./common.js";
import { cssColor } from "./palette.js";

const MARKS = { agent: "has eaten", hungry: "has not eaten", lit: "active sensor", meal: "eating" };

export class Legend {
  constructor() {
    this.kinds = el("span", { class: "entries" });
    this.lessons = legendEntry("learns from", { class: "mark lesson" });
    this.lessons.hidden = true;
    const entries = Object.entries(MARKS).map(([mark, text]) =>
      legendEntry(text, { class: `mark ${mark}` }),
    );
    this.root = el(
      "div",
      { class: "legend", role: "group", "aria-label": "Legend", "data-testid": "legend" },
      this.kinds,
      entries,
      this.lessons,
    );
  }

  /** Show the kinds of items in worlds of these appearances, each once. */
  show(appearances) {
    this.lessons.hidden = !appearances.some(({ lessons }) => lessons);
    const different = new Map(
      appearances
        .flatMap(({ item_kinds: kinds }) => kinds)
        .map(({ name, colour }) => [name, colour]),
    );
    this.kinds.replaceChildren(
      ...[...different].map(([name, colour]) =>
        legendEntry(name, { class: "mark item", style: `background: ${cssColor(colour)}` }),
      ),
    );
  }
}

/** Return a mark with its text. */
function legendEntry(text, mark) {
  return el("span", { class: "entry" }, el("i", mark), text);
}
