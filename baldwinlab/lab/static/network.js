/** Draw a network: units by activation, links by weight, and arcs to memory units. */

import { FONT, palette } from "./palette.js";

// Only the first links of a large network are drawn.
const MAX_LINKS = 800;
const LABEL_FONT = `11px ${FONT}`;

/**
 * Draw a network into a box, in CSS pixels.
 * @param {CanvasRenderingContext2D} pen
 * @param {{left: number, top: number, width: number, height: number}} box
 * @param {{sizes: number[], biases: boolean, weights: ArrayLike<number>|null, activations:
 *   ArrayLike<number>, inputs: string[], memory: number[][], actions: string[], action:
 *   number|null}} net activations of all units, inputs first; `memory` contains pairs (source unit,
 *   memory unit); `action` is the output with a ring
 */
export function drawNetwork(pen, box, net) {
  const names = [...net.inputs, ...net.memory.map((_, unit) => `memory ${unit + 1}`)].slice(
    0,
    net.sizes[0],
  );
  const positions = placeUnits(net.sizes, box, measureLabels(pen, names, net.actions));
  if (net.weights) drawWeights(pen, positions, net);
  drawMemory(pen, positions.flat(), net.memory);
  drawUnits(pen, positions, net);
  drawLabels(pen, positions[0], names, "right", -11);
  drawLabels(pen, positions.at(-1), net.actions, "left", 11);
}

/** Return the widths of the labels of the first and the last layer. */
function measureLabels(pen, names, actions) {
  pen.font = LABEL_FONT;
  return [names, actions].map(
    (texts) => 16 + Math.max(...texts.map((text) => pen.measureText(text).width)),
  );
}

function placeUnits(sizes, { left, top, width, height }, labelWidths) {
  const [leftWidth, rightWidth] = labelWidths;
  const inner = left + leftWidth;
  const innerWidth = width - leftWidth - rightWidth;
  return sizes.map((count, layer) => {
    const x = inner + (innerWidth * layer) / (sizes.length - 1);
    const spacing = Math.min(height / count, count <= 4 ? 30 : 14.5);
    return Array.from({ length: count }, (_, unit) => [
      x,
      top + height / 2 + (unit - (count - 1) / 2) * spacing,
    ]);
  });
}

function drawWeights(pen, positions, { sizes, biases, weights }) {
  let index = 0;
  let lines = 0;
  for (let layer = 0; layer + 1 < sizes.length; layer++) {
    for (let from = 0; from < sizes[layer]; from++) {
      for (let to = 0; to < sizes[layer + 1] && lines < MAX_LINKS; to++, lines++) {
        drawLink(
          pen,
          positions[layer][from],
          positions[layer + 1][to],
          weights[index + from * sizes[layer + 1] + to],
        );
      }
    }
    index += (sizes[layer] + Number(biases)) * sizes[layer + 1];
  }
}

function drawLink(pen, from, to, weight) {
  pen.strokeStyle = weight < 0 ? palette.chosen : palette.agent;
  pen.globalAlpha = Math.min(0.85, 0.1 + Math.abs(weight) * 0.3);
  pen.lineWidth = Math.min(4, 0.4 + Math.abs(weight) * 0.9);
  pen.beginPath();
  pen.moveTo(...from);
  pen.lineTo(...to);
  pen.stroke();
  pen.globalAlpha = 1;
}

/** Draw arcs to the units that repeat the activation of another unit one step later. */
function drawMemory(pen, positions, memory) {
  pen.strokeStyle = palette.soft;
  pen.lineWidth = 1;
  pen.setLineDash([3, 3]);
  for (const [source, target] of memory) {
    const [[fromX, fromY], [toX, toY]] = [positions[source], positions[target]];
    pen.beginPath();
    pen.moveTo(fromX, fromY);
    pen.quadraticCurveTo((fromX + toX) / 2, Math.min(fromY, toY) - 26, toX, toY);
    pen.stroke();
  }
  pen.setLineDash([]);
}

function drawUnits(pen, positions, { activations, action }) {
  let unit = 0;
  positions.forEach((layer, number) => {
    const isEnd = number === 0 || number === positions.length - 1;
    const endRadius = isEnd ? 7 : 4.8;
    const radius = layer.length > 12 ? 3.5 : endRadius;
    layer.forEach((position, index) => {
      drawUnit(
        pen,
        position,
        radius,
        activations[unit++],
        number === 0,
        number === positions.length - 1 && index === action,
      );
    });
  });
}

function drawUnit(pen, [x, y], radius, activation, isInput, isChosen) {
  pen.beginPath();
  pen.arc(x, y, radius, 0, 2 * Math.PI);
  pen.fillStyle = palette.map;
  pen.fill();
  pen.fillStyle = isInput ? palette.lit : palette.agent;
  pen.globalAlpha = Math.min(1, Math.max(0, activation));
  pen.fill();
  pen.globalAlpha = 1;
  pen.lineWidth = isChosen ? 2.5 : 1.2;
  pen.strokeStyle = isChosen ? palette.text : palette.soft;
  pen.stroke();
}

/**
 * Draw a network without layers. The depth of a unit is its longest path from an input.
 * @param {object} net as for `drawNetwork`, with `links` instead of weights, sizes and memory:
 *   (from unit, to unit, weight) of each link; unit -1 is the bias
 */
export function drawGraph(pen, box, net) {
  const links = Array.from(
    { length: net.links.length / 3 },
    (_, link) => net.links.subarray(3 * link, 3 * link + 3),
  );
  const outputs = net.activations.length - net.actions.length;
  const inputs = [...net.inputs.keys(), -1];
  const columns = groupByDepth(links, inputs, outputs, net.activations.length);
  const names = [...net.inputs, "bias"];
  const positions = placeUnits(
    columns.map((column) => column.length),
    box,
    measureLabels(pen, names, net.actions),
  );
  const positionOf = new Map(
    columns.flatMap((column, depth) =>
      column.map((unit, index) => [unit, positions[depth][index]])
    ),
  );
  for (const [from, to, weight] of links)
    drawLink(pen, positionOf.get(from), positionOf.get(to), weight);
  for (const [unit, position] of positionOf) {
    const isEnd = unit < net.inputs.length || unit >= outputs;
    drawUnit(
      pen,
      position,
      isEnd ? 7 : 4.8,
      unit < 0 ? 1 : net.activations[unit],
      unit < net.inputs.length,
      unit - outputs === net.action,
    );
  }
  drawLabels(pen, positions[0], names, "right", -11);
  drawLabels(pen, positions.at(-1), net.actions, "left", 11);
}

/** Return the units in columns: inputs first, outputs last, each after its sources. */
function groupByDepth(links, inputs, firstOutput, units) {
  const depths = new Map(inputs.map((unit) => [unit, 0]));
  for (const unit of links.flatMap(([from, to]) => [from, to]))
    if (!depths.has(unit)) depths.set(unit, 1);
  for (let round = 0; round < depths.size; round++) {
    for (const [from, to] of links) depths.set(to, Math.max(depths.get(to), depths.get(from) + 1));
  }
  const last = 1 +
    Math.max(0, ...[...depths].filter(([unit]) => unit < firstOutput).map(([, depth]) => depth));
  const columns = Array.from(
    { length: last },
    (_, depth) =>
      [...depths.keys()].filter((unit) => unit < firstOutput && depths.get(unit) === depth),
  );
  return [
    ...columns,
    Array.from({ length: units - firstOutput }, (_, output) => firstOutput + output),
  ];
}

/** Return the first of the largest outputs. */
export function findLargestOutput(activations, outputs) {
  const first = activations.length - outputs;
  let best = 0;
  for (let output = 1; output < outputs; output++)
    if (activations[first + output] > activations[first + best]) best = output;
  return best;
}

function drawLabels(pen, layer, texts, align, offset) {
  pen.fillStyle = palette.soft;
  pen.font = LABEL_FONT;
  pen.textAlign = align;
  pen.textBaseline = "middle";
  layer.forEach(([x, y], unit) => pen.fillText(texts[unit] ?? "", x + offset, y));
}
