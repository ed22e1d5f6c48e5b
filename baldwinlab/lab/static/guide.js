/** The guide "What is this?". It is shown until the user closes it, and on request. */

import { navigate } from "./address.js";
import { el, createIcon } from "./common.js";

// The prefix of the keys in localStorage. The name of a view follows.
const STORAGE_PREFIX = "baldwinlab.closed-guide.";
// Replaces localStorage if the browser does not allow it.
const closed = new Set();
const CLOSE_ICON = "M5 5l10 10M15 5L5 15";

/** @typedef {{title: string, text: string|Node}} Topic */

export class Guide {
  /** @param {HTMLElement} opener the button that shows and hides the guide */
  constructor(opener) {
    this.opener = opener;
    this.content = el("div", { class: "guide-words" });
    const close = el(
      "button",
      {
        type: "button",
        class: "quiet square spread",
        "aria-label": "Close",
        "data-testid": "close-guide",
      },
      createIcon(CLOSE_ICON),
    );
    const head = el("div", { class: "row" }, el("h2", {}, "What is this?"), close);
    this.root = el(
      "section",
      {
        id: "guide",
        class: "guide",
        tabindex: "0",
        "aria-label": "What is this?",
        "data-testid": "guide",
      },
      head,
      this.content,
    );
    close.addEventListener("click", () => this.close());
    opener.addEventListener("click", () => (this.open ? this.close() : this.openByUser()));
    this.root.addEventListener("keydown", (event) => {
      if (event.key !== "Escape") return;
      // Escape closes the guide, but not the inspector.
      event.stopPropagation();
      this.close();
    });
  }

  /**
   * Set the current view and its first topics.
   * @param {Topic[]} topics
   */
  setView(view, topics) {
    this.view = view;
    this.setTopics(topics);
  }

  /**
   * Set the topics.
   * @param {Topic[]} topics
   */
  setTopics(topics) {
    this.topics = topics;
    this.content.replaceChildren(
      ...topics.map(({ title, text }) =>
        el("div", {}, el("h3", {}, title), text instanceof Node ? text : el("p", {}, text)),
      ),
    );
    this.show();
  }

  /** Open the guide if the address says so, or at the first visit. Embedded pages stay closed. */
  applyState({ guide }) {
    this.open = guide === "open" || (window === window.parent && !wasClosed(this.view));
    this.show();
  }

  show() {
    this.root.hidden = !this.open || !this.topics.length;
    this.opener.setAttribute("aria-expanded", String(!this.root.hidden));
  }

  openByUser() {
    this.open = true;
    this.show();
    this.root.scrollIntoView({ block: "nearest" });
    navigate({ guide: "open" });
  }

  close() {
    this.hide();
    this.opener.focus();
  }

  /** Close the guide without moving the focus. */
  hide() {
    this.open = false;
    rememberClosed(this.view);
    this.show();
    navigate({ guide: null });
  }
}

function wasClosed(view) {
  try {
    return closed.has(view) || localStorage.getItem(STORAGE_PREFIX + view) !== null;
  } catch {
    return false;
  }
}

function rememberClosed(view) {
  closed.add(view);
  try {
    localStorage.setItem(STORAGE_PREFIX + view, "");
  } catch {
    // The guide opens again at the next visit.
  }
}
