/** The legend of the marks on a map. */

import { el } from "./common.js";
import { cssColor } from "./palette.js";

const MARKS = { agent: "has eaten", hungry: "has not eaten", lit: "active sensor", meal: "eating" };

export class Legend {
  constructor() {
    this.kinds = el("span", { class: "entries" });
    this.teachers = legendEntry("learns from", { class: "mark lesson" });
    this.teachers.hidden = true;
    const entries = Object.entries(MARKS).map(([mark, text]) =>
      legendEntry(text, { class: `mark ${mark}` }),
    );
    this.root = el(
      "div",
      { class: "legend", role: "group", "aria-label": "Legend", "data-testid": "legend" },
      this.kinds,
      entries,
      this.teachers,
    );
  }

  /** Show the kinds of items in worlds of these appearances, each once. */
  show(appearances) {
    this.teachers.hidden = !appearances.some(({ has_teachers: hasTeachers }) => hasTeachers);
    const different = new Map(
      appearances
        .flatMap(({ item_kinds: kinds }) => kinds)
        .map(({ name, color }) => [name, color]),
    );
    this.kinds.replaceChildren(
      ...[...different].map(([name, color]) =>
        legendEntry(name, { class: "mark item", style: `background: ${cssColor(color)}` }),
      ),
    );
  }
}

/** Return a mark with its text. */
function legendEntry(text, mark) {
  return el("span", { class: "entry" }, el("i", mark), text);
}
