/** The list of agents with the number of eaten items. A click opens the inspector. */

import { createButton, el, formatNumber } from "../core/common.js";
import { drawSpeciesSwatch } from "./agents.js";

// Maximum number of listed agents.
const MAX_LISTED = 40;
// Milliseconds between two updates.
const UPDATE_INTERVAL = 120;

export class Population {
  /** @param {(agent: number) => void} pick */
  constructor(pick) {
    this.pick = pick;
    this.list = el("div", { class: "agents" });
    this.facts = el("p", { class: "soft number" });
    this.root = el(
      "section",
      { class: "population", "aria-label": "All agents", "data-testid": "population" },
      el("header", {}, el("h2", {}, "Agents"), this.facts),
      this.list,
    );
    this.rows = [];
    this.drawn = 0;
  }

  /** Update the numbers at a step. During playback, not at every frame. */
  draw(recording, step, playing) {
    const now = performance.now();
    const totals = recording.arrays.eaten_in_life.subarray(-recording.agents);
    if (
      !this.root.clientWidth ||
      (recording === this.recording &&
        (step === this.step || (playing && now - this.drawn < UPDATE_INTERVAL)))
    )
      return;
    if (recording !== this.recording) this.buildLines(recording, totals);
    this.recording = recording;
    this.step = step;
    this.drawn = now;
    this.rows.forEach(({ agent, bar, number, line }) => {
      const eaten = recording.countEaten(step + 1, agent);
      if (number.textContent === String(eaten)) return;
      number.textContent = eaten;
      line.setAttribute("aria-label", recording.describeEater(step + 1, agent));
      bar.style.transform = `scaleX(${eaten / this.best})`;
      line.classList.toggle("fed", eaten > 0);
    });
  }

  /** Build the list: all agents in order, or the agents that eat most. */
  buildLines(recording, lifetimeTotals) {
    this.best = Math.max(1, ...[...lifetimeTotals]);
    const agents = Array.from({ length: recording.agents }, (_, agent) => agent);
    const shown = agents.length <= MAX_LISTED ? agents : agents
      .sort((first, second) => lifetimeTotals[second] - lifetimeTotals[first])
      .slice(0, MAX_LISTED);
    this.facts.textContent = agents.length <= MAX_LISTED
      ? "Items eaten so far. Click an agent to inspect it."
      : `The ${MAX_LISTED} agents that eat most, of ${formatNumber(agents.length)}.`;
    this.rows = shown.map((agent) => {
      const bar = el("i", {});
      const number = el("b", { class: "number" });
      const species = recording.findSpecies(agent);
      const line = createButton(
        [
          el("span", { class: "number" }, species && drawSpeciesSwatch(species), agent),
          el("span", { class: "gauge" }, bar),
          number,
        ],
        () => this.pick(agent),
        {
          class: "agent-line",
          "aria-label": recording.describeEater(recording.first, agent),
          "data-testid": `agent-${agent}`,
        },
      );
      return { agent, bar, number, line };
    });
    const { activeElement } = document;
    const focused = this.list.contains(activeElement) && activeElement.getAttribute("data-testid");
    this.list.replaceChildren(...this.rows.map(({ line }) => line));
    // Keep the focus on the same agent.
    if (focused) this.rows.find(({ line }) => line.dataset.testid === focused)?.line.focus();
  }
}
