/** Draw the networks of an agent: units by activation, links by weight, arcs to memory. */

import { palette } from "../core/palette.js";

// Only the first links of a large network are drawn.
const MAX_LINKS = 800;

/**
 * Draw a network into a box, in CSS pixels: with layers, or a graph of links.
 * @param {CanvasRenderingContext2D} pen
 * @param {{left: number, top: number, width: number, height: number}} box
 * @param {{inputs: string[], actions: string[], action: number|null, activations:
 *   ArrayLike<number>, links?: Float32Array, sizes?: number[], biases?: boolean, weights?:
 *   ArrayLike<number>|null, memory?: number[][]}} net activations of all units, inputs first;
 *   `action` is the output with a ring; `links` contains (from unit, to unit, weight) of each link,
 *   and unit -1 is the bias; `memory` contains pairs (source unit, memory unit)
 */
export function drawNetwork(pen, box, net) {
  const { columns, links, names, memory } = net.links ? readGraph(net) : readLayers(net);
  const sizes = columns.map((column) => column.length);
  const positions = placeUnits(sizes, box, measureLabels(pen, names, net.actions));
  const positionOf = new Map(
    columns.flatMap((column, number) =>
      column.map((unit, index) => [unit, positions[number][index]])
    ),
  );
  for (const [from, to, weight] of links)
    drawLink(pen, positionOf.get(from), positionOf.get(to), weight);
  drawMemory(pen, positionOf, memory);
  columns.forEach((column, number) => {
    const isInput = number === 0;
    const isOutput = number === columns.length - 1;
    const endRadius = isInput || isOutput ? 7 : 4.8;
    const radius = column.length > 12 ? 3.5 : endRadius;
    column.forEach((unit, index) => {
      const activation = unit < 0 ? 1 : net.activations[unit];
      const isChosen = isOutput && index === net.action;
      drawUnit(pen, positionOf.get(unit), radius, activation, isInput, isChosen);
    });
  });
  drawLabels(pen, positions[0], names, "right", -11);
  drawLabels(pen, positions.at(-1), net.actions, "left", 11);
}

/** Return the units of each layer, the first links, and the names of inputs and memory units. */
function readLayers(/** @type {Object<string, any>} */ { sizes, biases, weights, inputs, memory }) {
  let first = 0;
  const columns = sizes.map((size) => Array.from({ length: size }, () => first++));
  const links = [];
  let index = 0;
  for (let layer = 0; weights && layer + 1 < sizes.length; layer++) {
    for (const [from, source] of columns[layer].entries()) {
      for (const [to, target] of columns[layer + 1].entries()) {
        if (links.length < MAX_LINKS)
          links.push([source, target, weights[index + from * sizes[layer + 1] + to]]);
      }
    }
    index += (sizes[layer] + Number(biases)) * sizes[layer + 1];
  }
  const names = [...inputs, ...memory.map((_, unit) => `memory ${unit + 1}`)];
  return { columns, links, names: names.slice(0, sizes[0]), memory };
}

/**
 * Return the units of a graph in columns: inputs first, outputs last, each after its sources. The
 * depth of a unit is its longest path from an input.
 */
function readGraph(/** @type {Object<string, any>} */ { links, inputs, actions, activations }) {
  const list = Array.from(
    { length: links.length / 3 },
    (_, link) => links.subarray(3 * link, 3 * link + 3),
  );
  const firstOutput = activations.length - actions.length;
  const depths = new Map([...inputs.keys(), -1].map((unit) => [unit, 0]));
  for (const [from, to] of list)
    for (const unit of [from, to]) if (!depths.has(unit)) depths.set(unit, 1);
  for (let round = 0; round < depths.size; round++) {
    for (const [from, to] of list) depths.set(to, Math.max(depths.get(to), depths.get(from) + 1));
  }
  const columns = [];
  for (const [unit, depth] of depths) if (unit < firstOutput) (columns[depth] ??= []).push(unit);
  columns.push(actions.map((_, output) => firstOutput + output));
  // Units after an output can leave a depth without units.
  return { columns: columns.filter(Boolean), links: list, names: [...inputs, "bias"], memory: [] };
}

/** Return the widths of the labels of the first and the last layer. */
function measureLabels(pen, names, actions) {
  pen.font = `11px ${palette.font}`;
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
function drawMemory(pen, positionOf, memory) {
  pen.strokeStyle = palette.soft;
  pen.lineWidth = 1;
  pen.setLineDash([3, 3]);
  for (const [source, target] of memory) {
    const [[fromX, fromY], [toX, toY]] = [positionOf.get(source), positionOf.get(target)];
    pen.beginPath();
    pen.moveTo(fromX, fromY);
    pen.quadraticCurveTo((fromX + toX) / 2, Math.min(fromY, toY) - 26, toX, toY);
    pen.stroke();
  }
  pen.setLineDash([]);
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
  pen.font = `11px ${palette.font}`;
  pen.textAlign = align;
  pen.textBaseline = "middle";
  layer.forEach(([x, y], unit) => pen.fillText(texts[unit] ?? "", x + offset, y));
}

// CSS pixels.
const NETWORK_HEIGHT = 150;
const TITLE_HEIGHT = 28;

/**
 * Draw the modules of an agent, one below the other.
 * @param {HTMLCanvasElement} canvas
 * @param {{header: object, arrays: object}} container of /api/agent
 * @param {number} row of the step in the container
 * @param {ArrayLike<number>} activations of the action module
 * @param {ArrayLike<number>} weights of the action module
 */
export function drawModules(canvas, { header, arrays }, row, activations, weights) {
  const { inputs, memory, modules } = header.appearance;
  const networks = listNetworks({ header, arrays }, row, activations, weights);
  const pixelRatio = Math.min(devicePixelRatio || 1, 2);
  const width = canvas.parentElement.clientWidth;
  const height = networks.length * (NETWORK_HEIGHT + TITLE_HEIGHT);
  resizeCanvas(canvas, width, height, pixelRatio);
  const pen = canvas.getContext("2d");
  pen.setTransform(pixelRatio, 0, 0, pixelRatio, 0, 0);
  pen.clearRect(0, 0, width, height);
  networks.forEach((network, number) => {
    const top = number * (NETWORK_HEIGHT + TITLE_HEIGHT);
    pen.fillStyle = palette.soft;
    pen.font = `600 12px ${palette.font}`;
    pen.textAlign = "left";
    pen.textBaseline = "alphabetic";
    pen.fillText(modules[number], 0, top + 13, width);
    const box = { left: 0, top: top + 20, width, height: NETWORK_HEIGHT };
    const { layer_sizes: sizes, biases } = header;
    const { links } = arrays;
    drawNetwork(pen, box, { ...network, inputs, memory, links, sizes, biases });
  });
}

/** Return the networks of an agent: the action module, and the module that teaches it. */
function listNetworks({ header, arrays }, row, activations, weights) {
  const { actions, answers } = header.appearance;
  const networks = [{ weights, activations, actions, action: arrays.action[row] }];
  if (!arrays.teacher) return networks;
  const units = activations.length;
  const targets = arrays.teacher_activations.subarray(row * units, (row + 1) * units);
  networks.push({
    weights: arrays.teacher,
    activations: targets,
    actions: answers.length ? actions.map((_, index) => answers[index] ?? "not used") : actions,
    // Only if the module has one output per action.
    action: arrays.error ? findLargestOutput(targets, actions.length) : null,
  });
  return networks;
}

function resizeCanvas(canvas, width, height, pixelRatio) {
  const pixelWidth = Math.round(width * pixelRatio);
  const pixelHeight = Math.round(height * pixelRatio);
  if (canvas.width === pixelWidth && canvas.height === pixelHeight) return;
  canvas.width = pixelWidth;
  canvas.height = pixelHeight;
  canvas.style.height = `${height}px`;
}
