/** Draw the networks of an agent on one canvas, with their titles. */

import { drawNetwork, findLargestOutput } from "./network.js";
import { FONT, palette } from "../core/palette.js";

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
    pen.font = `600 12px ${FONT}`;
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
