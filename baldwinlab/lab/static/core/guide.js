/** The guide: "What is this?", the Baldwin effect, and the texts of each view. */

import { navigate } from "./address.js";
import { CLOSE_ICON, createButton, createIconButton, el } from "./common.js";

// The values of `guide` in the address.
const VIEW = "open";
const DEFINITION = "baldwin";
const TITLES = { [VIEW]: "What is this?", [DEFINITION]: "The Baldwin effect" };

/** @typedef {{title: string, text: string|Node}} Topic */

export class Guide {
  /** @param {HTMLElement} opener the button that shows and hides the guide */
  constructor(opener) {
    this.opener = opener;
    // VIEW, DEFINITION or null.
    this.shown = null;
    this.summary = "";
    this.topics = [];
    this.title = el("h2");
    this.content = el("div", { class: "guide-words" });
    const close = createIconButton("Close", CLOSE_ICON, () => this.close(), {
      class: "quiet square spread",
      title: null,
      "data-testid": "close-guide",
    });
    this.root = el(
      "section",
      {
        id: "guide",
        class: "guide",
        tabindex: "0",
        hidden: true,
        "aria-label": "What is this?",
        "data-testid": "guide",
      },
      el("div", { class: "row" }, this.title, close),
      this.content,
    );
    opener.addEventListener("click", () => this.toggle(VIEW, opener));
    this.root.addEventListener("keydown", (event) => {
      if (event.key !== "Escape") return;
      // Escape closes the guide, but not the inspector.
      event.stopPropagation();
      this.close();
    });
  }

  /**
   * Set the texts of the current view.
   * @param {string} summary at most three sentences
   * @param {Topic[]} [topics] details, which are folded
   */
  setTexts(summary, topics = []) {
    this.summary = summary;
    this.topics = topics;
    this.show();
  }

  /** Return a button that shows the definition of the Baldwin effect. */
  createDefinitionLink() {
    const toggle = () => this.toggle(DEFINITION, link);
    const link = createButton("What is the Baldwin effect?", toggle, {
      class: "term",
      "data-testid": "baldwin-effect",
    });
    return link;
  }

  /** Show the text that the address names. */
  applyState({ guide }) {
    this.shown = guide in TITLES ? guide : null;
    this.show();
  }

  show() {
    const text = this.shown === DEFINITION ? BALDWIN_EFFECT : this.summary;
    this.root.hidden = !this.shown || !text;
    this.opener.setAttribute("aria-expanded", String(!this.root.hidden && this.shown === VIEW));
    if (this.root.hidden) return;
    this.title.textContent = TITLES[this.shown];
    const definition = { title: TITLES[DEFINITION], text: BALDWIN_EFFECT };
    const topics = this.shown === VIEW && this.topics.length ? [definition, ...this.topics] : [];
    this.content.replaceChildren(
      el("p", {}, text),
      ...(topics.length ? [foldTopics(topics)] : []),
    );
  }

  /** Show a text, or hide it if it is visible. `source` gets the focus when it closes. */
  toggle(text, source) {
    if (this.shown === text) return this.close();
    this.shown = text;
    this.source = source;
    this.show();
    this.root.scrollIntoView({ block: "nearest" });
    navigate({ guide: text });
  }

  close() {
    this.shown = null;
    this.show();
    navigate({ guide: null });
    (this.source?.isConnected ? this.source : this.opener).focus();
  }
}

function foldTopics(topics) {
  return el(
    "details",
    { "data-testid": "guide-details" },
    el("summary", {}, "More about this model"),
    el(
      "div",
      { class: "guide-topics" },
      ...topics.map(({ title, text }) =>
        el("div", {}, el("h3", {}, title), text instanceof Node ? text : el("p", {}, text))
      ),
    ),
  );
}

const BALDWIN_EFFECT =
  "In the Baldwin effect, learning changes the course of evolution, although nothing learned is" +
  " inherited. First, agents that learn a useful behavior have more children, and later the" +
  " behavior becomes innate.";

export const LIVE =
  "This tab simulates evolution while you watch. In each generation, all agents live one life, " +
  "and the fittest agents have children. Press Start, change one setting, and start again: " +
  "earlier runs stay in the chart.";

/** For a lab with a server. @type {Topic[]} */
export const LIVE_TOPICS = [
  {
    title: "The curves",
    text:
      "With several runs, a curve is their mean, and the band is the 95 % confidence interval of" +
      " the mean. Click a curve to watch that generation. A difference that appears with one" +
      " seed only can be due to chance.",
  },
  {
    title: "Next steps",
    text:
      "Compare runs several presets, or several values of a setting, and shows which is higher. " +
      "Save as a study stores a live run. The Results tab shows both.",
  },
];

export const WORLD =
  "A lifetime of each population, step by step. Filled agents have eaten, and the bars under the" +
  " map show when. Click an agent to see what it senses and learns.";

/** The generation slider of a stored run. */
export const CURVE =
  "The curve at the generation slider shows this run: the line is the best agent, the area is" +
  " the average agent.";

/** Models without a world, by the kind of view. @type {Object<string, string>} */
export const VIEWS = {
  alleles: "Each bar is one locus, and its parts show the share of agents that are born with each" +
    " allele. A part that grows is an allele that spreads. A bar of one part means that all" +
    " agents have the same allele.",
  path: "Each line shows one value from birth (0) to death. A line that changes during life shows" +
    " learning. If the value at birth changes over the generations, innate behavior evolves.",
  matrix:
    "Each cell contains one number. A stronger color means a larger number. Compare generations" +
    " to see which rows change.",
  grid:
    "The blue dart is the agent, and the line is its path. Press Space to play or pause, and the" +
    " arrow keys to move one step. The same number in another generation is a different agent" +
    " with its own genome.",
};

export const PAPERS =
  "Each card is a publication that you can reproduce. An open card says what to notice, to try " +
  "and to extend, and has the command of the complete paper. If this folder contains a study of " +
  "the paper, its card shows the verdicts.";

export const RESULTS =
  "Each curve is the median of one condition over its runs, and the band is its 95 % confidence" +
  " interval. The comparison says whether the runs establish a difference. Click a" +
  " curve to watch that generation.";

/** @type {Topic[]} */
export const RESULTS_TOPICS = [
  {
    title: "The boxes",
    text: "Each point is one run, averaged over its last generations. The line in a box is the" +
      " median, and the box contains half of the runs. If the points scatter widely, a single" +
      " run says little.",
  },
];
