/** The relatives of an agent: parents, teachers and children. */

import { createButton, el } from "../core/common.js";

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
