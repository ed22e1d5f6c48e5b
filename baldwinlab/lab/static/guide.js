/** "What is this?": the words of a view, there until they have been closed once, and whenever they are asked for. */

import { navigate } from "./address.js";
import { el, icon } from "./common.js";

const CLOSED = "baldwinlab.closed-guide."; // and a view's name: what localStorage remembers
const closed = new Set(); // the same, where a browser lets no page remember
const CROSS = "M5 5l10 10M15 5L5 15";

/** @typedef {{title: string, text: string|Node}} Topic */

export class Guide {
  /** @param {HTMLElement} opener the button that shows it, and hides it */
  constructor(opener) {
    this.opener = opener;
    this.words = el("div", { class: "guide-words" });
    const close = el(
      "button",
      {
        type: "button",
        class: "quiet square spread",
        "aria-label": "Close",
        "data-testid": "close-guide",
      },
      icon(CROSS),
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
      this.words,
    );
    close.addEventListener("click", () => this.close());
    opener.addEventListener("click", () => (this.open ? this.close() : this.openByUser()));
    this.root.addEventListener("keydown", (event) => {
      if (event.key !== "Escape") return;
      event.stopPropagation(); // it closes these words, and not an agent as well
      this.close();
    });
  }

  /** Another view comes, with what it can say of itself at once. @param {Topic[]} topics */
  setView(view, topics) {
    this.view = view;
    this.setTopics(topics);
  }

  /** @param {Topic[]} topics */
  setTopics(topics) {
    this.topics = topics;
    this.words.replaceChildren(
      ...topics.map(({ title, text }) =>
        el("div", {}, el("h3", {}, title), text instanceof Node ? text : el("p", {}, text)),
      ),
    );
    this.show();
  }

  /** Show it if the address, or a first visit, asks for it; a page that frames this one has words of its own. */
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

  /** Give its place to what the reader has started; the focus stays where it is. */
  hide() {
    this.open = false;
    rememberClosed(this.view);
    this.show();
    navigate({ guide: null });
  }
}

function wasClosed(view) {
  try {
    return closed.has(view) || localStorage.getItem(CLOSED + view) !== null;
  } catch {
    return false;
  }
}

function rememberClosed(view) {
  closed.add(view);
  try {
    localStorage.setItem(CLOSED + view, "");
  } catch {
    // then it is there again at the next visit
  }
}
