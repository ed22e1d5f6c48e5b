/** What the marks in a world mean. */

import { el } from "./common.js";
import { cssShade } from "./palette.js";

const MARKS = { agent: "has eaten", hungry: "never ate", lit: "sensor fires", meal: "eats now" };

export class Legend {
  constructor() {
    this.kinds = el("span", { class: "entries" });
    const entries = Object.entries(MARKS).map(([mark, text]) => entry(text, { class: `mark ${mark}` }));
    this.root = el("div", { class: "legend", role: "group", "aria-label": "Legend", "data-testid": "legend" }, this.kinds, entries);
  }

  /** The kinds of items that there are, each once. */
  showKinds(kinds) {
    const different = new Map(kinds.map(({ name, colour }) => [name, colour]));
    this.kinds.replaceChildren(
      ...[...different].map(([name, colour]) => entry(name, { class: "mark item", style: `background: ${cssShade(colour)}` })),
    );
  }
}

/** A mark, and what it is. */
function entry(text, mark) {
  return el("span", { class: "entry" }, el("i", mark), text);
}
