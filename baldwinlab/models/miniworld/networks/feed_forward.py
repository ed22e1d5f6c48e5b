"""Feed-forward networks of logistic units, one network per lane, with or without biases.

Units are numbered layer by layer, from the inputs.
`activations` and `errors` [unit, lane] have a row per unit.
Weights are ordered by layer, then by source unit, then by target unit.
The biases of a layer follow the weights of this layer.

Source: Le (2019), "The neural network controller".
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, ClassVar

import numpy as np
import numpy.typing as npt

from baldwinlab.engine.arithmetic import sigmoid
from baldwinlab.engine.jit import compiled
from baldwinlab.engine.simd import HALF, ONE, ZERO, Lane, Value, any_of, fill_lanes, get, put
from baldwinlab.parts.networks import Network, Training

# [layer]: number of units of each layer, from the inputs to the outputs.
Sizes = npt.NDArray[np.int64]
# Array [row, lane].
Rows = npt.NDArray[np.float32]


@compiled
def has_zero_inputs(biases: bool, inputs: int, activations: Rows, lane: Lane) -> bool:
    """Return whether all inputs of all lanes are 0 and there are no biases.

    The units of the first hidden layer then have the activation 1/2, and the weights from the
    inputs do not change. Most agents have zero inputs in most steps, and skipping this layer halves
    the time. The results are identical.
    """
    # A single test is easier to predict than a test for each input. The sum is 0 only if each input
    # is 0, and NaN if an input is NaN.
    total = fill_lanes(lane, ZERO)
    for i in range(inputs):
        total = total + abs(get(activations, i, lane))
    return not (biases or any_of(total != ZERO))


@compiled
def feed_forward(sizes: Sizes, biases: bool, weights: Rows, activations: Rows, lane: Lane) -> None:
    """Compute all rows of `activations` from the first rows, which are the inputs."""
    # First source unit and first weight of the layer.
    source = 0
    weight = 0
    is_first_skipped = has_zero_inputs(biases, sizes[0], activations, lane)
    for layer in range(sizes.size - 1):
        inputs = sizes[layer]
        outputs = sizes[layer + 1]
        target = source + inputs
        for unit in range(outputs):
            if layer == 0 and is_first_skipped:
                put(activations, target + unit, lane, HALF)
                continue
            total = get(weights, weight + unit, lane) * get(activations, source, lane)
            for i in range(1, inputs):
                total = total + get(weights, weight + i * outputs + unit, lane) * get(
                    activations, source + i, lane
                )
            if biases:
                total = total + get(weights, weight + inputs * outputs + unit, lane)
            put(activations, target + unit, lane, sigmoid(total))
        weight += (inputs + int(biases)) * outputs
        source = target


@compiled
def _output_error(training: Training, unit: int, output: int, lane: Lane) -> Value:
    """Return the error of output `output`, which is in row `unit`, times the learning rate."""
    y = get(training.activations, unit, lane)
    return training.rate * (y - get(training.targets, output, lane)) * y * (ONE - y)


@compiled
def backpropagate(sizes: Sizes, biases: bool, training: Training, lane: Lane) -> None:
    """Take one step of online backpropagation of the outputs toward the targets.

    The step follows the gradient of half the squared error.
    The activations must be those of `feed_forward` with the same weights.

    Source: Rumelhart, Hinton and Williams 1986, which the paper cites for the learning rule.
    """
    weights = training.weights
    activations = training.activations
    errors = training.errors
    layers = sizes.size - 1
    # First target unit and first weight of the layer, from the last layer to the first.
    target = 0
    weight = 0
    for layer in range(layers):
        target += sizes[layer]
        weight += (sizes[layer] + int(biases)) * sizes[layer + 1]
    for unit in range(sizes[layers]):
        error = _output_error(training, target + unit, unit, lane)
        put(errors, target + unit, lane, error)
    # With zero inputs, the weights of the first layer do not change.
    first_layer = 1 if has_zero_inputs(biases, sizes[0], activations, lane) else 0
    for layer in range(layers - 1, first_layer - 1, -1):
        inputs = sizes[layer]
        outputs = sizes[layer + 1]
        source = target - inputs
        weight -= (inputs + int(biases)) * outputs
        # The errors of the source units depend on the weights before the changes below.
        if layer > first_layer:
            _backpropagate_errors(
                inputs, outputs, source, weight, weights, activations, errors, lane
            )
        for i in range(inputs):
            a = get(activations, source + i, lane)
            for unit in range(outputs):
                row = weight + i * outputs + unit
                put(
                    weights,
                    row,
                    lane,
                    get(weights, row, lane) - get(errors, target + unit, lane) * a,
                )
        if biases:
            for unit in range(outputs):
                row = weight + inputs * outputs + unit
                put(weights, row, lane, get(weights, row, lane) - get(errors, target + unit, lane))
        target = source


@compiled
def _backpropagate_errors(
    inputs: int,
    outputs: int,
    source: int,
    weight: int,
    weights: Rows,
    activations: Rows,
    errors: Rows,
    lane: Lane,
) -> None:
    """Compute the errors of the source units of a layer from the errors of the target units.

    `source` is the row of the first source unit. The target units follow the source units.
    """
    target = source + inputs
    for i in range(inputs):
        a = get(activations, source + i, lane)
        error = get(errors, target, lane) * get(weights, weight + i * outputs, lane)
        for unit in range(1, outputs):
            error = error + get(errors, target + unit, lane) * get(
                weights, weight + i * outputs + unit, lane
            )
        put(errors, source + i, lane, error * a * (ONE - a))


@compiled
def forward_three(hidden: int, weights: Rows, activations: Rows, lane: Lane) -> None:
    """Compute `feed_forward` for three inputs, one hidden layer, three outputs and no biases."""
    first_output = 3 + hidden
    if has_zero_inputs(False, 3, activations, lane):
        for unit in range(hidden):
            put(activations, 3 + unit, lane, HALF)
    else:
        left = get(activations, 0, lane)
        front = get(activations, 1, lane)
        right = get(activations, 2, lane)
        for unit in range(hidden):
            total = get(weights, unit, lane) * left + get(weights, hidden + unit, lane) * front
            put(
                activations,
                3 + unit,
                lane,
                sigmoid(total + get(weights, 2 * hidden + unit, lane) * right),
            )
    row = 3 * hidden
    a = get(activations, 3, lane)
    first = get(weights, row, lane) * a
    second = get(weights, row + 1, lane) * a
    third = get(weights, row + 2, lane) * a
    for unit in range(1, hidden):
        row = 3 * hidden + 3 * unit
        a = get(activations, 3 + unit, lane)
        first = first + get(weights, row, lane) * a
        second = second + get(weights, row + 1, lane) * a
        third = third + get(weights, row + 2, lane) * a
    put(activations, first_output, lane, sigmoid(first))
    put(activations, first_output + 1, lane, sigmoid(second))
    put(activations, first_output + 2, lane, sigmoid(third))


@compiled
def backward_three(hidden: int, training: Training, lane: Lane) -> None:
    """Compute `backpropagate` for the network of `forward_three`."""
    weights = training.weights
    activations = training.activations
    first_output = 3 + hidden
    first = _output_error(training, first_output, 0, lane)
    second = _output_error(training, first_output + 1, 1, lane)
    third = _output_error(training, first_output + 2, 2, lane)
    if has_zero_inputs(False, 3, activations, lane):
        for unit in range(hidden):
            row = 3 * hidden + 3 * unit
            a = get(activations, 3 + unit, lane)
            put(weights, row, lane, get(weights, row, lane) - first * a)
            put(weights, row + 1, lane, get(weights, row + 1, lane) - second * a)
            put(weights, row + 2, lane, get(weights, row + 2, lane) - third * a)
        return
    left = get(activations, 0, lane)
    front = get(activations, 1, lane)
    right = get(activations, 2, lane)
    for unit in range(hidden):
        row = 3 * hidden + 3 * unit
        a = get(activations, 3 + unit, lane)
        first_weight = get(weights, row, lane)
        second_weight = get(weights, row + 1, lane)
        third_weight = get(weights, row + 2, lane)
        error = (
            (first * first_weight + second * second_weight + third * third_weight) * a * (ONE - a)
        )
        put(weights, row, lane, first_weight - first * a)
        put(weights, row + 1, lane, second_weight - second * a)
        put(weights, row + 2, lane, third_weight - third * a)
        put(weights, unit, lane, get(weights, unit, lane) - error * left)
        put(weights, hidden + unit, lane, get(weights, hidden + unit, lane) - error * front)
        put(weights, 2 * hidden + unit, lane, get(weights, 2 * hidden + unit, lane) - error * right)


@compiled
def _has_three_inputs_and_outputs(sizes: Sizes, biases: bool) -> bool:
    """Return whether `forward_three` can compute the network."""
    return sizes.size == 3 and sizes[0] == 3 and sizes[2] == 3 and not biases


class FeedForward(Network, name="feed-forward"):
    """Layers of logistic units, without memory.

    A network of three inputs, one hidden layer and three outputs has separate code, with identical
    results.

    References
    ----------
    Le 2019.
    """

    derived: ClassVar[Mapping[str, Any]] = {
        "sizes": lambda part, experiment: np.array(experiment.layer_sizes, np.int64),
        "biases": lambda part, experiment: experiment.network.biases,
    }

    @staticmethod
    def forward(part: Any, weights: Rows, activations: Rows, lane: Lane) -> None:
        if _has_three_inputs_and_outputs(part.sizes, part.biases):
            forward_three(part.sizes[1], weights, activations, lane)
        else:
            feed_forward(part.sizes, part.biases, weights, activations, lane)

    @staticmethod
    def backward(part: Any, training: Training, lane: Lane) -> None:
        if _has_three_inputs_and_outputs(part.sizes, part.biases):
            backward_three(part.sizes[1], training, lane)
        else:
            backpropagate(part.sizes, part.biases, training, lane)
