/**
 * The agent inspector: networks, weights and relatives of one agent, synchronized with the player.
 */

import { Ancestors, createRelatives } from "./relatives.js";
import {
  CLOSE_ICON,
  createButton,
  createIconButton,
  el,
  formatNumber,
  getBinary,
  showMessage,
} from "../core/common.js";
import { drawModules, findLargestOutput } from "./network.js";
import { Responses } from "./responses.js";
import { createLifetimeQuery } from "../core/sources.js";
import { createColorKey, LifetimeChart } from "../charts/lifetime_chart.js";

// Maximum number of weights in the chart.
const MAX_LINES = 200;

export class Inspector {
  /**
   * @param {{open: (source: import("../core/sources.js").Source, agent: number) => void, close: () =>
   *   void, seek: (step: number) => void, toggled: () => void}} callbacks
   */
  constructor(callbacks) {
    this.callbacks = callbacks;
    this.data = null;
    this.createReadouts();
    this.createCharts();
    this.ancestors = new Ancestors(callbacks.open);
    this.body = this.createBody();
    this.root = el(
      "section",
      { class: "inspector", "aria-label": "Agent inspector", tabindex: -1, hidden: true },
      this.createHeader(),
      this.body,
      this.ancestors.root,
    );
    this.showAncestors(false);
  }

  createReadouts() {
    this.title = el("h2", { "data-testid": "agent" });
    this.facts = el("p", { class: "soft number" });
    this.inputs = el("div", { class: "row inputs" });
    this.action = el("span", { class: "action", "data-testid": "action" });
    this.responses = new Responses();
    this.relatives = el("div", { class: "relatives", "data-testid": "relatives" });
  }

  createCharts() {
    const { seek } = this.callbacks;
    this.canvas = el("canvas", {
      role: "img",
      "aria-label": "The networks, with activations and weights",
      "data-testid": "networks",
    });
    this.traces = {
      error: new LifetimeChart("error between the networks", seek),
      weights: new LifetimeChart("weight changes, since birth", seek, 110),
      eaten: new LifetimeChart("items eaten", seek),
    };
    this.traces.weights.root.append(
      createColorKey(["lit", "first layer"], ["agent", "later layers"]),
    );
  }

  createBody() {
    const weightKey = createColorKey(
      ["agent", "positive weight"],
      ["chosen", "negative weight (wider: larger)"],
    );
    return el(
      "div",
      {
        class: "inside",
        tabindex: 0,
        role: "group",
        "aria-label": "Networks, weights and relatives",
      },
      el("div", { class: "row" }, this.inputs, this.action),
      el("figure", {}, this.canvas, weightKey),
      this.responses.root,
      ...Object.values(this.traces).map(({ root }) => root),
      this.relatives,
    );
  }

  createHeader() {
    const toggleAncestors = () => {
      this.showAncestors(!this.showsAncestors);
      this.callbacks.toggled();
    };
    this.ancestorsButton = createButton("Ancestors", toggleAncestors, {
      class: "chip spread",
      "data-testid": "ancestors-of",
    });
    const closeButton = createIconButton("Close", CLOSE_ICON, this.callbacks.close, {
      title: null,
      "data-testid": "close-agent",
    });
    return el(
      "header",
      { class: "row" },
      el("div", {}, this.title, this.facts),
      this.ancestorsButton,
      closeButton,
    );
  }

  hide() {
    this.root.hidden = true;
    this.stop?.abort();
    this.requested = this.data = null;
    this.showAncestors(false);
  }

  /** Show the ancestors of the agent, or its networks. */
  showAncestors(isShown) {
    this.showsAncestors = isShown;
    this.ancestorsButton.setAttribute("aria-pressed", isShown);
    this.body.hidden = isShown;
    this.ancestors.root.hidden = !isShown;
    if (!isShown) this.ancestors.cancel();
    if (!this.requested) return;
    if (isShown) this.ancestors.show(this.source, this.agent);
    this.callbacks.seek(null);
  }

  /**
   * Inspect an agent of a lifetime. A response contains a part of a very long lifetime, from
   * `first`.
   */
  async show(source, agent, first = null) {
    const requested = `${createLifetimeQuery(source)}&agent=${agent}`;
    this.root.hidden = false;
    if (requested === this.requested && (first === null || first === this.first)) return;
    this.requested = requested;
    this.first = first ?? 0;
    this.source = source;
    this.agent = agent;
    this.stop?.abort();
    this.stop = new AbortController();
    this.title.textContent = `Agent ${agent}`;
    if (this.showsAncestors) this.ancestors.show(source, agent);
    this.root.classList.add("waiting");
    try {
      this.setData(
        source,
        await getBinary(`api/agent?${requested}&first=${this.first}`, this.stop.signal),
      );
    } catch (error) {
      if (error.name === "AbortError") return;
      showMessage(error.message, "error");
      this.callbacks.close();
    }
  }

  setData(source, data) {
    this.data = data;
    this.root.classList.remove("waiting");
    const { header, arrays } = data;
    this.inputs.replaceChildren(
      ...header.appearance.inputs.map((name) => el("span", { class: "sensor" }, name)),
    );
    if (header.species) this.title.textContent = `Agent ${header.agent}, ${header.species}`;
    // The rank is unknown if the fitness depends on earlier generations that are not stored.
    const rank = header.rank === null ? "" : ` · rank\u00a0${header.rank}`;
    this.facts.textContent = `${formatNumber(header.food)} items eaten${rank}`;
    this.traces.error.root.hidden = !arrays.error;
    this.responses.set(data);
    this.setTraces(header, arrays);
    this.relatives.replaceChildren(...createRelatives(source, header, this.callbacks.open));
    this.callbacks.seek(null);
  }

  setTraces({ first, layer_sizes: sizes, biases }, arrays) {
    const { eaten, error, weights } = this.traces;
    const steps = arrays.sample_step.at(-1);
    const eatenLine = { values: arrays.eaten_in_life, first, color: "meal" };
    eaten.set([eatenLine], steps, 0, Math.max(1, arrays.eaten_in_life.at(-1)));
    if (arrays.error) {
      const errorLine = { values: arrays.error, first, color: "chosen" };
      error.set([errorLine], steps, 0, findMaximum(arrays.error));
    }
    const count = arrays.weights.length / arrays.sample_step.length;
    const changes = arrays.weights.map((weight, index) => weight - arrays.weights[index % count]);
    const maximum = findMaximum(changes);
    // The first weights of a network are the weights of its first layer.
    const firstLayerCount = (sizes[0] + Number(biases)) * sizes[1];
    const lines = Array.from({ length: Math.min(count, MAX_LINES) }, (_, offset) => ({
      x: arrays.sample_step,
      values: changes,
      stride: count,
      offset,
      color: offset < firstLayerCount ? "lit" : "agent",
      alpha: 0.6,
    }));
    weights.set(lines, steps, -maximum, maximum);
    this.currentWeights = new Float32Array(count);
  }

  /** Show the state at a step. */
  draw(step) {
    if (!this.data || this.root.hidden) return;
    if (this.showsAncestors) return this.ancestors.draw();
    const { header, arrays } = this.data;
    const units = header.layer_sizes.reduce((sum, size) => sum + size, 0);
    if (step < header.first || step >= header.last) {
      this.show(this.source, this.agent, step < this.traces.eaten.steps ? step : header.first);
      return;
    }
    const row = step - header.first;
    const active = arrays.activations.subarray(row * units, (row + 1) * units);
    [...this.inputs.children].forEach((light, input) =>
      this.showInput(light, header.appearance, input, active[input])
    );
    this.showAction(
      header.appearance.actions,
      arrays.action[row],
      findLargestOutput(active, header.layer_sizes.at(-1)),
    );
    this.responses.draw(step, active.subarray(0, header.appearance.inputs.length));
    this.interpolateWeights(step);
    drawModules(this.canvas, this.data, row, active, this.currentWeights);
    const { error, weights, eaten } = this.traces;
    if (arrays.error) error.draw(step, formatNumber(arrays.error[row]));
    weights.draw(step, `distance from birth ${formatNumber(this.computeWeightDistance())}`);
    eaten.draw(step, formatNumber(arrays.eaten_in_life[row]));
  }

  /** Show an input. A real-valued input also shows its number. */
  showInput(light, { inputs, is_continuous: isContinuous }, input, value) {
    light.classList.toggle("lit", value > 0);
    if (isContinuous[input]) light.textContent = `${inputs[input]} ${formatNumber(value)}`;
  }

  /** Show the performed action, and whether it was due to noise. */
  showAction(actions, performed, largest) {
    const isNoise = performed !== largest;
    const text = isNoise ? `${actions[performed]} (noise)` : actions[performed];
    if (this.action.textContent === text) return;
    this.action.textContent = text;
    this.action.classList.toggle("noise", isNoise);
    this.action.title = isNoise ? `The largest output was ${actions[largest]}.` : "";
  }

  /** Interpolate the weights at a step between two samples. */
  interpolateWeights(step) {
    const { sample_step: at, weights } = this.data.arrays;
    let after = at.findIndex((sampled) => sampled > step);
    if (after <= 0) after = at.length - 1;
    const share = Math.min(1, (step - at[after - 1]) / (at[after] - at[after - 1]));
    const count = this.currentWeights.length;
    for (let weight = 0; weight < count; weight++) {
      const before = weights[(after - 1) * count + weight];
      this.currentWeights[weight] = before + (weights[after * count + weight] - before) * share;
    }
  }

  /** Return the distance between the current weights and the weights at birth. */
  computeWeightDistance() {
    const { weights } = this.data.arrays;
    return Math.sqrt(
      this.currentWeights.reduce((sum, weight, index) => sum + (weight - weights[index]) ** 2, 0),
    );
  }
}

function findMaximum(values) {
  let maximum = 0.001;
  for (const value of values) maximum = Math.max(maximum, Math.abs(value));
  return maximum;
}
