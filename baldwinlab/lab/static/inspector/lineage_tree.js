/** The lineage tree of an agent: ancestors above it, siblings next to it, children below it. */

import { el, formatNumber } from "../core/common.js";
import { bindButtons, createSvg, drawTextLabel } from "../core/drawing.js";
import { palette } from "../core/palette.js";

// SVG units.
const WIDTH = 320;
const ROW_HEIGHT = 44;
const MARGIN = 16;
const LEFT = 34;
const MIN_RADIUS = 4;
const MAX_RADIUS = 8;

/**
 * @typedef {{generation: number, agents: number[], eaten: number[]}} Row
 * @typedef {{rows: Row[], links: number[][], omitted: number}} Tree of /api/lineage
 */

/**
 * Return the drawing of a tree.
 * @param {Tree} tree
 * @param {{generation: number, agent: number}} subject
 * @param {(generation: number, agent: number) => void} open
 */
export function createLineageTree({ rows, links, omitted }, subject, open) {
  const nodes = rows.flatMap((row, index) => placeRow(row, index));
  const find = (generation, agent) =>
    nodes.find((node) => node.generation === generation && node.agent === agent);
  const height = 2 * MARGIN + (rows.length - 1) * ROW_HEIGHT;
  const lines = links.map(([generation, child, parent]) =>
    drawLink(find(generation, child), find(generation - 1, parent))
  );
  const maximum = Math.max(1, ...nodes.map(({ eaten }) => eaten));
  const circles = nodes.map((node) => drawNode(node, maximum, subject));
  bindButtons(
    circles,
    nodes.map(describeNode),
    (index) => open(nodes[index].generation, nodes[index].agent),
  );
  const names = rows.map(({ generation }, index) =>
    drawTextLabel(String(generation), 2, MARGIN + index * ROW_HEIGHT + 4)
  );
  const svg = createSvg(
    "svg",
    { viewBox: `0 0 ${WIDTH} ${height}`, role: "group", "aria-label": "Lineage tree" },
    ...names,
    ...lines,
    ...circles,
  );
  const note =
    "A row is a generation. The size of a circle is the number of items eaten, and a line leads" +
    ` from a parent to its child.${omitted ? ` Not drawn: ${omitted} siblings and children.` : ""}`;
  return el("figure", { class: "lineage" }, svg, el("figcaption", { class: "soft" }, note));
}

/** Return the nodes of a row, evenly spaced. */
function placeRow({ generation, agents, eaten }, index) {
  const distance = (WIDTH - LEFT) / agents.length;
  return agents.map((agent, position) => ({
    generation,
    agent,
    eaten: eaten[position],
    x: LEFT + distance * (position + 0.5),
    y: MARGIN + index * ROW_HEIGHT,
  }));
}

function describeNode({ generation, agent, eaten }) {
  return `agent ${agent}, generation ${generation}, ${formatNumber(eaten)} eaten`;
}

function drawLink(child, parent) {
  const middle = (child.y + parent.y) / 2;
  return createSvg("path", {
    d: `M${parent.x} ${parent.y}C${parent.x} ${middle} ${child.x} ${middle} ${child.x} ${child.y}`,
    fill: "none",
    stroke: "currentColor",
    "stroke-opacity": 0.35,
  });
}

function drawNode(node, maximum, subject) {
  const isSubject = node.generation === subject.generation && node.agent === subject.agent;
  return createSvg(
    "circle",
    {
      cx: node.x,
      cy: node.y,
      r: MIN_RADIUS + (MAX_RADIUS - MIN_RADIUS) * (node.eaten / maximum),
      fill: isSubject ? palette.chosen : palette.agent,
      stroke: "currentColor",
      "stroke-width": isSubject ? 2 : 0,
    },
    createSvg("title", {}, describeNode(node)),
  );
}
