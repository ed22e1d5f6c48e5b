/** A world outside the World tab: with zoom, the number of eaten items, and a selected agent. */

import { createOptions, el } from "./common.js";
import { FrameView } from "./frame_view.js";
import { bindGestures } from "./gestures.js";
import { WorldView } from "./world.js";
import { createZoomButtons } from "./zoom_tools.js";

/** Return a single recording as a complete lifetime. */
export function createLifetime(recording) {
  const { header, steps } = recording;
  return { header, steps, parts: new Map([[0, recording]]), findPart: (_step) => recording };
}

export class WorldFigure {
  /**
   * @param {string} label of the world
   * @param {string} testid
   * @param {{invalidate: () => void, picked?: (agent: number|null) => void}} callbacks
   */
  constructor(label, testid, { invalidate, picked = () => {} }) {
    this.invalidate = invalidate;
    this.picked = picked;
    this.life = null;
    this.agent = null;
    this.canvas = el("canvas", {
      tabindex: 0,
      role: "img",
      "aria-label": label,
      "data-testid": testid,
    });
    this.view = new WorldView(this.canvas);
    this.stage = el("div", { class: "figure-stage" }, this.canvas);
    this.count = el("span", { class: "soft number", "data-testid": `${testid}-count` });
    const choose = () => this.pick(this.picker.value === "" ? null : Number(this.picker.value));
    this.picker = el("select", {
      "aria-label": "Agent to follow",
      "data-testid": `${testid}-agent`,
      onchange: choose,
    });
    // A list of many agents would be too long.
    this.number = el("input", {
      type: "number",
      min: 0,
      step: 1,
      placeholder: "agent",
      hidden: true,
      "aria-label": "Agent to inspect",
      "data-testid": `${testid}-agent-number`,
      onchange: () => this.pickNumber(),
    });
    this.frames = new FrameView(this.view, invalidate);
    this.facts = el("p", { class: "number", hidden: true, "data-testid": `${testid}-facts` });
    this.foot = el(
      "div",
      { class: "row figure-foot" },
      this.count,
      el(
        "span",
        { class: "figure-tools" },
        this.picker,
        this.number,
        createZoomButtons({ zoom: (factor) => this.zoom(factor), fit: () => this.fit() }),
      ),
      this.frames.legend.root,
    );
    bindGestures(this.canvas, this.view, {
      changed: () => this.onCameraChange(),
      picked: (agent) => this.pick(agent),
      fitted: () => this.fit(),
    });
    this.sized = new ResizeObserver(() => {
      this.view.resize();
      invalidate();
    });
    this.sized.observe(this.canvas);
  }

  /**
   * @param {import("./recording.js").Lifetime|import("./frame_stream.js").FrameStream} life or the
   *   result of `createLifetime`
   */
  show(life) {
    this.life = life;
    const { agents } = life.header;
    this.picker.hidden = Boolean(life.isStream);
    this.number.hidden = !life.isStream;
    this.number.max = String(agents - 1);
    if (life.isStream) this.picker.replaceChildren();
    else {
      this.frames.legend.hide();
      this.listAgents(life);
    }
    this.pick(this.agent !== null && this.agent < agents ? this.agent : null);
  }

  /** Fill the list of agents. */
  listAgents(life) {
    const { agents } = life.header;
    const firstPart = life.parts.values().next().value;
    // The species of an agent can change from generation to generation.
    if (this.picker.options.length !== agents + 1 || life.header.species) {
      const describe = (_, agent) => [agent, firstPart.describeAgent(agent)];
      const names = Array.from({ length: agents }, describe);
      this.picker.replaceChildren(...createOptions([["", "all agents"], ...names]));
    }
  }

  /** Select the agent of the number field, if the world has it. */
  pickNumber() {
    const isAgent = this.number.value !== "" && this.number.checkValidity();
    this.pick(isAgent ? Number(this.number.value) : null);
  }

  /** Select an agent, or none. */
  pick(agent) {
    const isOther = agent !== this.agent;
    this.agent = agent;
    this.picker.value = agent ?? "";
    this.number.value = agent ?? "";
    this.facts.hidden = agent === null || Boolean(this.life?.isStream);
    this.invalidate();
    if (isOther) this.picked(agent);
  }

  zoom(factor) {
    this.view.zoomAt(factor);
    this.onCameraChange();
  }

  fit() {
    this.view.setCamera(0.5, 0.5, 1);
    this.onCameraChange();
  }

  onCameraChange() {
    this.stage.classList.toggle("zoomed", this.view.camera.zoom > 1);
    this.invalidate();
  }

  /**
   * @param {number} time in steps
   * @param {number} [pace] steps per second of playback
   * @returns {{isLoaded: boolean, ready: boolean}} whether the moment is loaded, and whether it is
   *   completely drawn
   */
  draw(time, pace = 0) {
    if (this.life?.isStream) {
      const drawn = this.frames.draw(this.life, time, { selectedAgent: this.agent, pace });
      setText(this.count, drawn.text);
      return drawn;
    }
    const recording = this.life?.findPart(Math.floor(time)) ?? null;
    const moment = Math.max(time, recording?.first ?? 0);
    const ready = this.view.draw(recording, moment, { selectedAgent: this.agent });
    if (recording) this.showFacts(recording, Math.min(Math.floor(moment), recording.last - 1));
    return { isLoaded: recording !== null || !this.life, ready };
  }

  showFacts(recording, step) {
    setText(this.count, recording.describeEaten(step + 1));
    if (this.agent === null) return;
    const { agent } = this;
    const senses = recording.listActiveInputs(step, agent);
    const action = recording.findAction(step, agent);
    const name = recording.describeAgent(agent).replace(/^a/, "A");
    const eaten = recording.countEaten(step + 1, agent);
    setText(
      this.facts,
      `${name}: ${eaten} eaten · senses: ${senses.join(", ") || "nothing"} · ` +
        `action: ${action}`,
    );
  }

  close() {
    this.sized.disconnect();
  }
}

function setText(element, text) {
  if (element.textContent !== text) element.textContent = text;
}
