/** The screen until the engine is ready: two recorded lifetimes, and the elapsed time. */

import { el, getBinary, getJSON, showMessage } from "./common.js";
import { Legend } from "./legend.js";
import { Recording } from "./recording.js";
import { createLifetime } from "./world_figure.js";
import { WorldPair } from "./world_pair.js";

// Milliseconds between two requests.
const POLL_INTERVAL = 500;
const SPEED = 10;
// Seconds of playback before the first meal.
const LEAD_TIME = 0.5;
// Agents that learn, and agents that cannot, from the same start.
const RECORDINGS = ["first_life.bald", "first_control.bald"];

// The last response of the server. The engine stays ready.
let engine = { ready: false, seconds: 0 };

/**
 * Wait until the engine is ready or the view is no longer current.
 * @param {HTMLElement} root is filled in the meantime
 */
export async function waitForEngine(root, isCurrent) {
  if (engine.ready) return;
  engine = await getJSON("api/engine");
  const screen = engine.ready || !isCurrent() ? null : new WaitingScreen(root);
  while (!engine.ready && isCurrent()) {
    screen.showElapsed(engine);
    await new Promise((resolve) => setTimeout(resolve, POLL_INTERVAL));
    engine = await getJSON("api/engine");
  }
  screen?.close();
  if (screen && isCurrent()) screen.restore();
}

class WaitingScreen {
  constructor(root) {
    this.root = root;
    this.initialClass = root.className;
    this.pair = new WorldPair("first");
    this.pair.player.setSpeed(SPEED);
    this.pair.player.changed = () => this.changed();
    this.legend = new Legend();
    this.seconds = el("span", { class: "number" });
    this.caption = el("p", { class: "soft" });
    root.replaceChildren(this.createElement());
    root.className = "view-first";
    this.load().catch((error) => showMessage(error.message, "error"));
  }

  createElement() {
    const { root: worlds, bar } = this.pair;
    const element = el(
      "section",
      { class: "first contrast", "data-testid": "first-life" },
      el("h1", {}, "Do agents that learn during life eat more than agents that cannot?"),
      worlds,
      bar.root,
      this.legend.root,
      this.createNotice(),
      this.caption,
    );
    element.addEventListener("keydown", (event) => bar.handleKey(event));
    return element;
  }

  /** Return the text that explains the compilation, with the elapsed time. */
  createNotice() {
    return el(
      "p",
      { class: "first-waiting" },
      el("span", { class: "spinner" }),
      el(
        "span",
        {},
        "The lab prepares its engine. On a new machine this takes up to 24 seconds. ",
        this.seconds,
      ),
    );
  }

  /** Handle a change of the player. The recording is repeated. */
  changed() {
    const { player, bar, lives } = this.pair;
    bar.showTime();
    if (lives.length && player.time >= player.last && !player.playing) player.play();
  }

  async load() {
    const recordings = await Promise.all(RECORDINGS.map((name) => getBinary(name)));
    const lives = recordings.map((container) => createLifetime(new Recording(container)));
    const { pair, caption } = this;
    const { player } = pair;
    const [{ header }] = lives;
    caption.textContent =
      `Recordings: ${lives.map(({ header: { condition } }) => condition).join(" and ")}, ` +
      `run ${header.run}, generation ${header.generation}.`;
    pair.show(lives);
    this.legend.show([header]);
    player.last = header.last - 1;
    player.seek(Math.max(0, Math.floor(pair.firstMeal - LEAD_TIME * player.pace)));
    player.autoplay();
  }

  showElapsed({ seconds }) {
    this.seconds.textContent = `Elapsed: ${Math.round(seconds)} s.`;
  }

  close() {
    this.pair.close();
  }

  /** Restore the previous state of the page. */
  restore() {
    this.root.className = this.initialClass;
    this.root.replaceChildren();
  }
}
