/**
 * The two networks of an agent, and its lessons: models/miniworld/networks/feed_forward.py.
 *
 * A network has three inputs, a hidden layer and three outputs. Weights are ordered by layer, then
 * by source unit, then by target unit.
 */

export const INPUTS = 3;
export const OUTPUTS = 3;

const squash = (total) => 1 / (1 + Math.exp(-total));

/** Return the activations of the hidden units and of the outputs. */
function computeActivations(weights, inputs) {
  const count = weights.length / (INPUTS + OUTPUTS);
  const hidden = Array.from(
    { length: count },
    (_, unit) =>
      squash(inputs.reduce((sum, input, i) => sum + input * weights[i * count + unit], 0)),
  );
  const outputs = Array.from({ length: OUTPUTS }, (_, output) =>
    squash(
      hidden.reduce(
        (sum, value, unit) => sum + value * weights[INPUTS * count + unit * OUTPUTS + output],
        0,
      ),
    ));
  return { hidden, outputs };
}

/** Return the index of the action of an agent: the largest output. A tie goes to the first. */
export function chooseAction(weights, inputs) {
  const { outputs } = computeActivations(weights, inputs);
  return outputs.indexOf(Math.max(...outputs));
}

/** Two networks with the weights at birth. The first one learns from the second one. */
export class Learner {
  /**
   * @param {number[]} genome the weights of both networks
   * @param {number} rate of learning
   */
  constructor(genome, rate) {
    const count = genome.length / 2;
    this.born = Float64Array.from(genome.slice(0, count));
    this.weights = this.born.slice();
    this.teacher = Float64Array.from(genome.slice(count));
    this.rate = rate;
  }

  /**
   * Learn in one step of a life: backpropagation toward the outputs of the second network.
   * @param {number[]} inputs
   * @returns {{before: number[], target: number[], after: number[]}} outputs
   */
  learn(inputs) {
    const { weights, rate } = this;
    const { outputs: target } = computeActivations(this.teacher, inputs);
    const { hidden, outputs: before } = computeActivations(weights, inputs);
    const errors = before.map((y, output) => rate * (y - target[output]) * y * (1 - y));
    const count = hidden.length;
    hidden.forEach((activation, unit) => {
      const first = INPUTS * count + unit * OUTPUTS;
      let hiddenError = 0;
      errors.forEach((error, output) => {
        hiddenError += error * weights[first + output];
        weights[first + output] -= error * activation;
      });
      hiddenError *= activation * (1 - activation);
      inputs.forEach((input, i) => (weights[i * count + unit] -= hiddenError * input));
    });
    return { before, target, after: computeActivations(weights, inputs).outputs };
  }
}
