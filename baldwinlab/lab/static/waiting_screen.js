/** The screen during compilation: a recorded lifetime and the elapsed time. */

import { el, getBinary, getJSON, showMessage } from "./common.js";
import { Legend } from "./legend.js";
import { Player } from "./player.js";
import { Recording } from "./recording.js";
import { TimeBar } from "./time_bar.js";
import { WorldFigure, createLifetime } from "./world_figure.js";

// Milliseconds between two requests.
const POLL_INTERVAL = 500;
const SPEED = 10;

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
    this.player = new Player((time) => this.draw(time));
    this.player.setSpeed(SPEED);
    this.figure = new WorldFigure("A recorded lifetime", "first-canvas", {
      invalidate: () => this.player.invalidate(),
    });
    this.bar = new TimeBar(this.player, "first");
    this.player.changed = () => this.changed();
    this.legend = new Legend();
    this.seconds = el("span", { class: "number" });
    this.caption = el("p", { class: "soft" });
    root.replaceChildren(this.createElement());
    root.className = "view-first";
    this.load().catch((error) => showMessage(error.message, "error"));
  }

  createElement() {
    const { stage, foot, facts } = this.figure;
    const element = el(
      "section",
      { class: "first", "data-testid": "first-life" },
      el("h1", {}, "Almost ready"),
      this.createNotice(),
      stage,
      facts,
      this.bar.root,
      foot,
      this.legend.root,
      this.caption,
    );
    element.addEventListener("keydown", (event) => this.bar.handleKey(event));
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
        "The lab compiles its engine for this machine. This happens once and takes about " +
          "as long as the recorded lifetime below. ",
        this.seconds,
      ),
    );
  }

  /** Handle a change of the player. The lifetime is repeated. */
  changed() {
    this.bar.showTime();
    const hasEnded = this.figure.life && this.player.time >= this.player.last;
    if (hasEnded && !this.player.playing) this.player.play();
  }

  async load() {
    const life = createLifetime(new Recording(await getBinary("first_life.bald")));
    const { header } = life;
    this.caption.textContent =
      `Recording: ${header.condition}, run ${header.run}, generation ` +
      `${header.generation}, first ${header.last.toLocaleString("en")} ` +
      "steps.";
    this.figure.show(life);
    this.legend.show([header]);
    this.player.last = header.last - 1;
    if (!matchMedia("(prefers-reduced-motion: reduce)").matches) this.player.play();
    this.player.invalidate();
  }

  draw(time) {
    const { life, agent } = this.figure;
    const { isLoaded, ready } = this.figure.draw(time);
    if (!ready) this.player.invalidate();
    if (life)
      this.bar.draw(Math.floor(time), this.player.last + 1, [{ life, selectedAgent: agent }]);
    return isLoaded;
  }

  showElapsed({ seconds }) {
    this.seconds.textContent = `Elapsed: ${Math.round(seconds)} s.`;
  }

  close() {
    this.player.close();
    this.figure.close();
  }

  /** Restore the previous state of the page. */
  restore() {
    this.root.className = this.initialClass;
    this.root.replaceChildren();
  }
}
