/** The legend of the marks on a map. */

import { el } from "../core/common.js";
import { formatColor } from "../core/palette.js";
import { drawSpeciesSwatch } from "./agents.js";

const MARKS = { agent: "has eaten", hungry: "has not eaten", lit: "active sensor", meal: "eating" };

export class Legend {
  constructor() {
    this.kinds = el("span", { class: "entries" });
    this.species = el("span", { class: "entries", "data-testid": "legend-species" });
    this.teachers = createLegendEntry("learns from", { class: "mark lesson" });
    this.teachers.hidden = true;
    const entries = Object.entries(MARKS).map(([mark, text]) =>
      createLegendEntry(text, { class: `mark ${mark}` })
    );
    this.root = el(
      "div",
      { class: "legend", role: "group", "aria-label": "Legend", "data-testid": "legend" },
      this.kinds,
      this.species,
      entries,
      this.teachers,
    );
  }

  /** Show the kinds of items and the species in the worlds of recordings, each once. */
  show(headers) {
    const appearances = headers.map(({ appearance }) => appearance);
    this.teachers.hidden = !appearances.some(({ has_teachers: hasTeachers }) => hasTeachers);
    const colorOfKind = new Map(
      appearances.flatMap(({ item_kinds: kinds }) => kinds).map(({ name, color }) => [name, color]),
    );
    this.kinds.replaceChildren(
      ...[...colorOfKind].map(([name, color]) =>
        createLegendEntry(name, { class: "mark item", style: `background: ${formatColor(color)}` })
      ),
    );
    const speciesByName = new Map(
      headers.flatMap(({ species = [] }) => species).map((entry) => [entry.name, entry]),
    );
    // Frames contain no sensors and no meals.
    this.root.classList.toggle("with-frames", headers[0].kind === "frames");
    // The marks of agents without species are darts.
    this.root.classList.toggle("with-species", speciesByName.size > 0);
    this.species.replaceChildren(
      ...[...speciesByName.values()].map((entry) =>
        el("span", { class: "entry" }, drawSpeciesSwatch(entry), entry.name)
      ),
    );
  }
}

/** Return a mark with its text. */
export function createLegendEntry(text, mark) {
  return el("span", { class: "entry" }, el("i", mark), text);
}
