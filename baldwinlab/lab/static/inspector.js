/**
 * The agent inspector: networks, weights and relatives of one agent, synchronized with the player.
 */

import { Ancestors } from "./ancestors.js";
import { el, format, getBinary, icon, message } from "./common.js";
import { drawGraph, drawNetwork, largestOutput } from "./network.js";
import { Responses } from "./responses.js";
import { query } from "./sources.js";
import { LifetimeChart, colorKey } from "./lifetime_chart.js";
import { FONT, palette } from "./palette.js";

// Maximum number of weights in the chart.
const MOST_LINES = 200;
// CSS pixels of a network.
const ROOM = 150;

export class Inspector {
  /**
   * @param {{open: (source: import("./sources.js").Source, agent: number) => void, close: () =>
   *   void, seek: (step: number) => void, toggled: () => void}} callbacks
   */
  constructor(callbacks) {
    this.callbacks = callbacks;
    this.title = el("h2", { "data-testid": "agent" });
    this.facts = el("p", { class: "soft number" });
    this.inputs = el("div", { class: "row inputs" });
    this.action = el("span", { class: "doing", "data-testid": "action" });
    this.nets = el("canvas", {
      role: "img",
      "aria-label": "The networks, with activations and weights",
      "data-testid": "networks",
    });
    this.traces = {
      error: new LifetimeChart("error between the networks", callbacks.seek),
      weights: new LifetimeChart("weight changes, since birth", callbacks.seek, 110),
      eaten: new LifetimeChart("items eaten", callbacks.seek),
    };
    this.responses = new Responses();
    this.kin = el("div", { class: "kin", "data-testid": "kin" });
    this.traces.weights.root.append(colorKey(["lit", "first layer"], ["agent", "later layers"]));
    this.body = el(
      "div",
      {
        class: "inside",
        tabindex: 0,
        role: "group",
        "aria-label": "Networks, weights and relatives",
      },
      el("div", { class: "row" }, this.inputs, this.action),
      el(
        "figure",
        {},
        this.nets,
        colorKey(["agent", "positive weight"], ["chosen", "negative weight (wider: larger)"]),
      ),
      this.responses.root,
      ...Object.values(this.traces).map(({ root }) => root),
      this.kin,
    );
    this.ancestors = new Ancestors(callbacks.open);
    const showAncestors = () => {
      this.showAncestors(!this.descent);
      callbacks.toggled();
    };
    this.ancestorsButton = el(
      "button",
      {
        type: "button",
        class: "chip spread",
        "data-testid": "ancestors-of",
        onclick: showAncestors,
      },
      "Ancestors",
    );
    const close = el(
      "button",
      {
        type: "button",
        class: "quiet square",
        "aria-label": "Close",
        "data-testid": "close-agent",
        onclick: callbacks.close,
      },
      icon("M5 5l10 10M15 5L5 15"),
    );
    this.root = el(
      "section",
      { class: "inspector", "aria-label": "Agent inspector", tabindex: -1, hidden: true },
      el(
        "header",
        { class: "row" },
        el("div", {}, this.title, this.facts),
        this.ancestorsButton,
        close,
      ),
      this.body,
      this.ancestors.root,
    );
    this.data = null;
    this.showAncestors(false);
  }

  hide() {
    this.root.hidden = true;
    this.stop?.abort();
    this.requested = this.data = null;
    this.showAncestors(false);
  }

  /** Show the ancestors of the agent instead of its networks. */
  showAncestors(descent) {
    this.descent = descent;
    this.ancestorsButton.setAttribute("aria-pressed", descent);
    this.body.hidden = descent;
    this.ancestors.root.hidden = !descent;
    if (!descent) this.ancestors.cancel();
    if (!this.requested) return;
    if (descent) this.ancestors.show(this.source, this.agent);
    this.callbacks.seek(null);
  }

  /**
   * Inspect an agent of a lifetime. A response contains a part of a very long lifetime, from
   * `first`.
   */
  async show(source, agent, first = null) {
    const requested = `${query(source)}&agent=${agent}`;
    this.root.hidden = false;
    if (requested === this.requested && (first === null || first === this.first)) return;
    Object.assign(this, { requested, first: first ?? 0, source, agent });
    this.stop?.abort();
    this.stop = new AbortController();
    this.title.textContent = `Agent ${agent}`;
    if (this.descent) this.ancestors.show(source, agent);
    this.root.classList.add("waiting");
    try {
      this.setData(
        source,
        await getBinary(`api/agent?${requested}&first=${this.first}`, this.stop.signal),
      );
    } catch (fault) {
      if (fault.name === "AbortError") return;
      message(fault.message, "error");
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
    this.facts.textContent =
      `${header.food.toLocaleString("en")} items eaten · ` + `rank\u00a0${header.rank}`;
    this.traces.error.root.hidden = !arrays.error;
    this.responses.set(data);
    const steps = arrays.sample_step.at(-1);
    const { first } = header;
    this.traces.eaten.set(
      [{ values: arrays.eaten_in_life, first, color: "meal" }],
      steps,
      0,
      Math.max(1, arrays.eaten_in_life.at(-1)),
    );
    if (arrays.error)
      this.traces.error.set(
        [{ values: arrays.error, first, color: "chosen" }],
        steps,
        0,
        maximumOf(arrays.error),
      );
    const count = arrays.weights.length / arrays.sample_step.length;
    const changes = arrays.weights.map((weight, at) => weight - arrays.weights[at % count]);
    const maximum = maximumOf(changes);
    const firstLayer = (header.layer_sizes[0] + Number(header.biases)) * header.layer_sizes[1];
    const lines = Array.from({ length: Math.min(count, MOST_LINES) }, (_, offset) => ({
      x: arrays.sample_step,
      values: changes,
      stride: count,
      offset,
      ...(offset < firstLayer
        ? { color: "lit", label: "first layer" }
        : { color: "agent", label: "later layers" }),
      alpha: 0.6,
    }));
    this.traces.weights.set(lines, steps, -maximum, maximum);
    this.currentWeights = new Float32Array(count);
    this.showRelatives(source, header);
    this.callbacks.seek(null);
  }

  showRelatives(source, { parents, teachers, children }) {
    const link = (agent, by) =>
      el(
        "button",
        {
          type: "button",
          class: "chip",
          "data-testid": by < 0 ? "parent" : "child",
          onclick: () =>
            this.callbacks.open({ ...source, generation: source.generation + by }, agent),
        },
        `agent ${agent}`,
      );
    const line = (title, links, none) =>
      el(
        "div",
        {},
        el("h3", {}, title),
        el("div", { class: "row" }, links.length ? links : el("span", { class: "soft" }, none)),
      );
    const couple = parents ? [...new Set(parents)] : [];
    this.kin.replaceChildren(
      line(
        couple.length ? `parents, in generation ${source.generation - 1}` : "parents",
        couple.map((agent) => link(agent, -1)),
        "none (random weights)",
      ),
      ...(teachers
        ? [
            el(
              "p",
              { class: "soft", "data-testid": "teachers" },
              describeTeachers([...new Set(teachers)], source.generation - 1),
            ),
          ]
        : []),
      line(
        children.length ? `children, in generation ${source.generation + 1}` : "children",
        children.map((agent) => link(agent, 1)),
        "none",
      ),
    );
  }

  /** Show the state at a step. */
  draw(step) {
    if (!this.data || this.root.hidden) return;
    if (this.descent) return this.ancestors.draw();
    const { header, arrays } = this.data;
    const units = header.layer_sizes.reduce((sum, size) => sum + size, 0);
    if (step < header.first || step >= header.last) {
      this.show(this.source, this.agent, step < this.traces.eaten.steps ? step : header.first);
      return;
    }
    const row = step - header.first;
    const active = arrays.activations.subarray(row * units, (row + 1) * units);
    [...this.inputs.children].forEach((light, input) =>
      this.light(light, header.appearance, input, active[input]),
    );
    this.showAction(
      header.appearance.actions,
      arrays.action[row],
      largestOutput(active, header.layer_sizes.at(-1)),
    );
    this.responses.draw(step, active.subarray(0, header.appearance.inputs.length));
    this.weightsAt(step);
    this.drawNets(active, row, units);
    const { error, weights, eaten } = this.traces;
    if (arrays.error) error.draw(step, format(arrays.error[row]));
    weights.draw(step, `distance from birth ${format(this.weightDistance())}`);
    eaten.draw(step, format(arrays.eaten_in_life[row]));
  }

  /** Show an input. A real-valued input also shows its number. */
  light(light, { inputs, is_continuous: isContinuous }, input, value) {
    light.classList.toggle("lit", value > 0);
    if (isContinuous[input]) light.textContent = `${inputs[input]} ${value.toFixed(2)}`;
  }

  /** Show the performed action, and whether it was due to noise. */
  showAction(actions, done, maximumOf) {
    const noise = done !== maximumOf;
    const text = noise ? `${actions[done]} (noise)` : actions[done];
    if (this.action.textContent === text) return;
    this.action.textContent = text;
    this.action.classList.toggle("noise", noise);
    this.action.title = noise ? `The largest output was ${actions[maximumOf]}.` : "";
  }

  /** Interpolate the weights at a step between two samples. */
  weightsAt(step) {
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

  /** Return the distance between the current weights and those at birth. */
  weightDistance() {
    const { weights } = this.data.arrays;
    return Math.sqrt(
      this.currentWeights.reduce((sum, weight, at) => sum + (weight - weights[at]) ** 2, 0),
    );
  }

  drawNets(active, row, units) {
    const { header, arrays } = this.data;
    const { inputs, actions, answers, memory, modules } = header.appearance;
    const nets = [
      { weights: this.currentWeights, activations: active, actions, action: arrays.action[row] },
    ];
    if (arrays.teacher) {
      const activations = arrays.teacher_activations.subarray(row * units, (row + 1) * units);
      // Only if it has one output per action.
      const action = arrays.error ? largestOutput(activations, actions.length) : null;
      const outputNames = answers.length
        ? actions.map((_, at) => answers[at] ?? "not used")
        : actions;
      nets.push({ weights: arrays.teacher, activations, actions: outputNames, action });
    }
    const dots = Math.min(devicePixelRatio || 1, 2);
    const width = this.nets.parentElement.clientWidth;
    const height = nets.length * (ROOM + 28);
    if (
      this.nets.width !== Math.round(width * dots) ||
      this.nets.height !== Math.round(height * dots)
    ) {
      Object.assign(this.nets, {
        width: Math.round(width * dots),
        height: Math.round(height * dots),
      });
      this.nets.style.height = `${height}px`;
    }
    const pen = this.nets.getContext("2d");
    pen.setTransform(dots, 0, 0, dots, 0, 0);
    pen.clearRect(0, 0, width, height);
    nets.forEach((net, number) => {
      const top = number * (ROOM + 28);
      pen.fillStyle = palette.soft;
      pen.font = `600 12px ${FONT}`;
      pen.textAlign = "left";
      pen.textBaseline = "alphabetic";
      pen.fillText(modules[number], 0, top + 13, width);
      const box = { left: 0, top: top + 20, width, height: ROOM };
      if (arrays.links) drawGraph(pen, box, { ...net, links: arrays.links, inputs });
      else
        drawNetwork(pen, box, {
          ...net,
          sizes: header.layer_sizes,
          biases: header.biases,
          inputs,
          memory,
        });
    });
  }
}

/** Return the sentence about the parents that taught the agent. */
function describeTeachers(teachers, generation) {
  const agents = `${teachers.length > 1 ? "agents" : "agent"} ${teachers.join(" and ")}`;
  return (
    `Taught by ${agents} of generation ${generation}. ` +
    "Its reinforcement module contains the weights that they had learned by their death."
  );
}

function maximumOf(values) {
  let maximum = 0.001;
  for (const value of values) maximum = Math.max(maximum, Math.abs(value));
  return maximum;
}
