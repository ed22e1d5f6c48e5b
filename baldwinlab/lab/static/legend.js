/** The legend of the marks on a map. */

import { el } from "./common.js";
import { formatColor } from "./palette.js";

const MARKS = { agent: "has eaten", hungry: "has not eaten", lit: "active sensor", meal: "eating" };

export class Legend {
  constructor() {
    this.kinds = el("span", { class: "entries" });
    this.teachers = createLegendEntry("learns from", { class: "mark lesson" });
    this.teachers.hidden = true;
    const entries = Object.entries(MARKS).map(([mark, text]) =>
      createLegendEntry(text, { class: `mark ${mark}` }),
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
    const colorOfKind = new Map(
      appearances.flatMap(({ item_kinds: kinds }) => kinds).map(({ name, color }) => [name, color]),
    );
    this.kinds.replaceChildren(
      ...[...colorOfKind].map(([name, color]) =>
        createLegendEntry(name, { class: "mark item", style: `background: ${formatColor(color)}` }),
      ),
    );
  }
}

/** Return a mark with its text. */
function createLegendEntry(text, mark) {
  return el("span", { class: "entry" }, el("i", mark), text);
}
