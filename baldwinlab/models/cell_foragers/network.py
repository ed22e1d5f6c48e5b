"""Networks of foragers, with one hidden layer of logistic units."""

from __future__ import annotations

from typing import Any, Final, NamedTuple

import numpy as np
import numpy.typing as npt

from baldwinlab.engine.arithmetic import sigmoid
from baldwinlab.engine.jit import compiled
from baldwinlab.engine.simd import ONE, ZERO

# Number of inputs: angle and distance of the nearest food, and the two bits of the next action.
N_INPUTS: Final = 4
# Number of outputs for the action: its two bits.
N_ACTION_OUTPUTS: Final = 2


class Layers(NamedTuple):
    """Sizes of a network, and its learning rate."""

    hidden: int
    outputs: int
    rate: np.float32


class Activations(NamedTuple):
    """Scratch arrays for the activations of both modules and for one step of learning."""

    # float32 [unit]: inputs, hidden units and outputs of the action module.
    values: npt.NDArray[np.float32]
    # float32 [unit]: the same for the teaching module.
    teacher: npt.NDArray[np.float32]
    # float32 [2]: target values of the two trained outputs.
    targets: npt.NDArray[np.float32]


@compiled
def compute_outputs(layers: Layers, weights: Any, values: Any) -> None:
    """Compute the hidden units and the outputs in `values` [unit] from the inputs in `values`."""
    hidden = layers.hidden
    outputs = layers.outputs
    for hidden_unit in range(hidden):
        total = weights[N_INPUTS * hidden + hidden_unit]
        for source in range(N_INPUTS):
            total += weights[source * hidden + hidden_unit] * values[source]
        values[N_INPUTS + hidden_unit] = sigmoid(total)
    # The weights of the hidden units, biases included, come first.
    first_output_weight = (N_INPUTS + 1) * hidden
    for output in range(outputs):
        total = weights[first_output_weight + hidden * outputs + output]
        for hidden_unit in range(hidden):
            total += (
                weights[first_output_weight + hidden_unit * outputs + output]
                * values[N_INPUTS + hidden_unit]
            )
        values[N_INPUTS + hidden + output] = sigmoid(total)


@compiled
def backpropagate(layers: Layers, weights: Any, units: Activations, first: Any) -> None:
    """Do one step of backpropagation, with targets for the outputs `first` and `first + 1`."""
    hidden = layers.hidden
    outputs = layers.outputs
    rate = layers.rate
    values = units.values
    first_output = N_INPUTS + hidden + first
    first_error = _output_error(values[first_output], units.targets[0])
    second_error = _output_error(values[first_output + 1], units.targets[1])
    output_weights = (N_INPUTS + 1) * hidden + first
    for hidden_unit in range(hidden):
        activation = values[N_INPUTS + hidden_unit]
        weight = output_weights + hidden_unit * outputs
        error = ZERO
        error += first_error * weights[weight]
        error += second_error * weights[weight + 1]
        weights[weight] -= rate * first_error * activation
        weights[weight + 1] -= rate * second_error * activation
        error = error * activation * (ONE - activation)
        for source in range(N_INPUTS):
            weights[source * hidden + hidden_unit] -= rate * error * values[source]
        weights[N_INPUTS * hidden + hidden_unit] -= rate * error
    biases = output_weights + hidden * outputs
    weights[biases] -= rate * first_error
    weights[biases + 1] -= rate * second_error


@compiled
def _output_error(activation: Any, target: Any) -> Any:
    return (activation - target) * activation * (ONE - activation)
