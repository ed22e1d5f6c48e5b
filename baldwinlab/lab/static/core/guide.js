/** The guide: "What is this?" in a few sentences, and the definition of the Baldwin effect. */

import { navigate } from "./address.js";
import { CLOSE_ICON, createButton, createIconButton, el } from "./common.js";
import { BALDWIN_EFFECT } from "./topics.js";

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
