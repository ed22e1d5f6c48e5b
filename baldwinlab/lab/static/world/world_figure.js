/** A map outside the World tab, with the eaten items, a list of agents, and zoom buttons. */

import { createOptions, el, setText } from "../core/common.js";
import { WorldMap } from "./world_map.js";
import { createZoomButtons } from "./gestures.js";

class WorldFigure extends WorldMap {
  constructor(label, testid, callbacks) {
    super(label, testid, callbacks);
    const { picked } = this.callbacks;
    this.picker = el("select", {
      "aria-label": "Agent to follow",
      "data-testid": `${testid}-agent`,
      onchange: () => picked(this.picker.value === "" ? null : Number(this.picker.value)),
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
      onchange: () => picked(this.readNumber()),
    });
    this.facts = el("p", { class: "number", hidden: true, "data-testid": `${testid}-facts` });
    this.foot = el(
      "div",
      { class: "row figure-foot" },
      this.note,
      el(
        "span",
        { class: "figure-tools" },
        this.picker,
        this.number,
        createZoomButtons(this, ["closer", "farther", "all"]),
      ),
      this.frames.legend.root,
    );
  }

  /** Return the agent of the number field, or null if the world does not have it. */
  readNumber() {
    const isAgent = this.number.value !== "" && this.number.checkValidity();
    return isAgent ? Number(this.number.value) : null;
  }

  show(life) {
    const { agents } = life.header;
    this.picker.hidden = life.isStream;
    this.number.hidden = !life.isStream;
    this.number.max = String(agents - 1);
    if (life.isStream) this.picker.replaceChildren();
    else this.listAgents(life);
    super.show(life);
    this.select(this.agent);
  }

  /** Fill the list of agents. */
  listAgents({ header, parts }) {
    const { agents, species } = header;
    // The species of an agent can change from generation to generation.
    if (this.picker.options.length === agents + 1 && !species) return;
    const [part] = parts.values();
    const names = Array.from({ length: agents }, (_, agent) => [agent, part.describeAgent(agent)]);
    this.picker.replaceChildren(...createOptions([["", "all agents"], ...names]));
  }

  select(agent) {
    super.select(agent);
    this.picker.value = agent ?? "";
    this.number.value = agent ?? "";
    this.facts.hidden = agent === null || Boolean(this.life?.isStream);
  }

  describeMoment(recording, step) {
    if (this.agent !== null) setText(this.facts, describeAgent(recording, step, this.agent));
    return super.describeMoment(recording, step);
  }
}

/** Return the eaten items, the inputs and the action of an agent in a step. */
function describeAgent(recording, step, agent) {
  const name = recording.describeAgent(agent).replace(/^a/, "A");
  const inputs = recording.listActiveInputs(step, agent).join(", ") || "nothing";
  return `${name}: ${recording.countEaten(step + 1, agent)} eaten · senses: ${inputs} · ` +
    `action: ${recording.findAction(step, agent)}`;
}

/**
 * Add a figure to a group of worlds.
 * @param {import("./world_group.js").WorldGroup} group
 * @param {string} label
 * @param {string} testid
 * @param {Partial<import("./world_map.js").MapCallbacks>} [callbacks]
 */
export function addFigure(group, label, testid, callbacks = {}) {
  const figure = new WorldFigure(label, testid, {
    invalidate: () => group.player.invalidate(),
    picked: (agent) => group.selectAgent(figure, agent),
    ...callbacks,
  });
  group.maps.push(figure);
  return figure;
}
