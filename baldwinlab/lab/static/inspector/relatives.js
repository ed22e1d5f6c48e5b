/** The relatives of an agent: parents, teachers and children, and all its ancestors. */

import {
  createButton,
  createTableHead,
  el,
  formatNumber,
  getJSON,
  showMessage,
} from "../core/common.js";
import { createLineageTree } from "./lineage_tree.js";
import { createLifetimeQuery } from "../core/sources.js";
import { createColorKey, LifetimeChart } from "../charts/lifetime_chart.js";

/**
 * @typedef {{first: number, agents: number[], eaten: number[], partners: number[],
 *   eaten_by_partners: number[], ancestors: number[], mean: number[]}} Line
 */

const COLUMNS = ["generation", "fitter parent", "other parent", "ancestors"];

export class Ancestors {
  /** @param {(source: import("../core/sources.js").Source, agent: number) => void} open */
  constructor(open) {
    this.open = open;
    this.description = el("p", { class: "soft" });
    this.trace = new LifetimeChart(
      "items eaten by the ancestors",
      (generation) => this.openGeneration(generation),
      96,
    );
    this.trace.root.append(createColorKey(["chosen", "this lineage"], ["meal", "average agent"]));
    this.rows = el("tbody");
    this.table = el("table", {}, createTableHead(COLUMNS), this.rows);
    this.tree = el("div", { "data-testid": "lineage" });
    this.root = el(
      "div",
      {
        class: "inside ancestors",
        tabindex: 0,
        role: "group",
        "aria-label": "Ancestors",
        "data-testid": "ancestors",
        hidden: true,
      },
      this.tree,
      this.trace.root,
      this.description,
      this.table,
    );
  }

  /** @param {import("../core/sources.js").Source} source */
  async show(source, agent) {
    const requested = `${createLifetimeQuery(source)}&agent=${agent}`;
    if (requested === this.requested) return;
    this.cancel();
    this.requested = requested;
    this.source = source;
    this.stop = new AbortController();
    this.root.classList.add("waiting");
    try {
      this.setLine(await getJSON(`api/ancestors?${requested}`, this.stop.signal));
      // The table is readable while the tree loads.
      this.root.classList.remove("waiting");
      await this.showTree(requested, agent);
    } catch (error) {
      if (error.name === "AbortError") return;
      this.cancel();
      showMessage(error.message, "error");
    }
    this.root.classList.remove("waiting");
  }

  /** Draw the lineage tree. */
  async showTree(requested, agent) {
    const tree = await getJSON(`api/lineage?${requested}`, this.stop.signal);
    const { source } = this;
    this.tree.replaceChildren(
      createLineageTree(
        tree,
        { generation: source.generation, agent },
        (generation, relative) => this.open({ ...source, generation }, relative),
      ),
    );
  }

  /** Cancel the pending request. */
  cancel() {
    this.stop?.abort();
    this.requested = null;
  }

  /** @param {Line} line */
  setLine(line) {
    this.line = line;
    const { first, agents, eaten, mean } = line;
    const last = first + agents.length - 1;
    const hasNoParents = agents.length === 1;
    this.description.textContent = hasNoParents
      ? "This agent has no parents: its weights are random."
      : `The table follows the fitter parent back to generation ${first} and shows how ` +
        "many items each agent ate. The last column is the number of ancestors in that " +
        "generation.";
    for (const part of [this.trace.root, this.table]) part.hidden = hasNoParents;
    const maximum = Math.max(1, ...eaten, ...mean);
    this.trace.set(
      [
        { values: mean, first, color: "meal" },
        { values: eaten, first, color: "chosen" },
      ],
      Math.max(1, last),
      0,
      maximum,
    );
    this.rows.replaceChildren(
      ...agents
        .slice(0, -1)
        .map((_, index) => this.createRow(index))
        .reverse(),
    );
    this.root.scrollTop = 0;
    this.draw();
  }

  createRow(index) {
    const { first, agents, eaten, partners, eaten_by_partners, ancestors } = this.line;
    const createCell = (agent, items) =>
      el("td", {}, this.createLink(first + index, agent), formatNumber(items));
    const partnerCell = partners[index] === agents[index]
      ? el("td", { class: "soft" }, "the same")
      : createCell(partners[index], eaten_by_partners[index]);
    return el(
      "tr",
      {},
      el("th", { scope: "row" }, formatNumber(first + index)),
      createCell(agents[index], eaten[index]),
      partnerCell,
      el("td", {}, formatNumber(ancestors[index])),
    );
  }

  createLink(generation, agent) {
    const open = () => this.open({ ...this.source, generation }, agent);
    return createButton(`agent ${agent}`, open, {
      class: "chip",
      "aria-label": `agent ${agent}, generation ${generation}`,
      "data-testid": "ancestor",
    });
  }

  /** Open the lifetime of the ancestor in a generation. */
  openGeneration(generation) {
    const { first, agents } = this.line;
    if (generation < first + agents.length - 1)
      this.open({ ...this.source, generation }, agents[generation - first]);
  }

  draw() {
    if (!this.line) return;
    const { first, agents, eaten } = this.line;
    const generation = first + agents.length - 1;
    this.trace.draw(
      generation,
      `generation ${formatNumber(generation)}: ${formatNumber(eaten.at(-1))}`,
    );
  }
}

/**
 * Return the parents, teachers and children of an agent, with links to their lifetimes.
 * @param {import("../core/sources.js").Source} source
 * @param {object} header of /api/agent
 * @param {(source: import("../core/sources.js").Source, agent: number) => void} open
 */
export function createRelatives(source, { parents, teachers, children }, open) {
  const createLink = (agent, offset) => {
    const generation = source.generation + offset;
    return createButton(`agent ${agent}`, () => open({ ...source, generation }, agent), {
      class: "chip",
      "data-testid": offset < 0 ? "parent" : "child",
    });
  };
  const uniqueParents = parents ? [...new Set(parents)] : [];
  const paragraph = teachers &&
    el(
      "p",
      { class: "soft", "data-testid": "teachers" },
      describeTeachers([...new Set(teachers)], source.generation - 1),
    );
  return [
    createLine(
      uniqueParents.length ? `parents, in generation ${source.generation - 1}` : "parents",
      uniqueParents.map((agent) => createLink(agent, -1)),
      "none (random weights)",
    ),
    ...(paragraph ? [paragraph] : []),
    createLine(
      children.length ? `children, in generation ${source.generation + 1}` : "children",
      children.map((agent) => createLink(agent, 1)),
      "none",
    ),
  ];
}

function createLine(title, links, emptyText) {
  return el(
    "div",
    {},
    el("h3", {}, title),
    el("div", { class: "row" }, links.length ? links : el("span", { class: "soft" }, emptyText)),
  );
}

/** Return the sentence about the parents that taught the agent. */
function describeTeachers(teachers, generation) {
  const agents = `${teachers.length > 1 ? "agents" : "agent"} ${teachers.join(" and ")}`;
  return (
    `Taught by ${agents} of generation ${generation}. ` +
    "Its reinforcement module contains the weights that they had learned by their death."
  );
}
