"""Networks of foragers: logistic units with biases, and one hidden layer."""

from __future__ import annotations

from typing import Any, Final, NamedTuple

import numpy as np
import numpy.typing as npt

from baldwinlab.engine.arithmetic import sigmoid
from baldwinlab.engine.jit import compiled

# The angle and the distance of the nearest food, and the two bits of the next action.
N_INPUTS: Final = 4
# Number of outputs for the planned action.
N_ACTION_OUTPUTS: Final = 2
ZERO = np.float32(0)
ONE = np.float32(1)


class Layers(NamedTuple):
    """Sizes of a network, and its learning rate."""

    hidden: int
    outputs: int
    rate: np.float32


class Activations(NamedTuple):
    """Scratch for the activations of two networks and for one step of learning."""

    # float32 [unit]: inputs, hidden units and outputs of the action module.
    values: npt.NDArray[np.float32]
    # float32 [unit]: the same for the teaching module.
    teacher: npt.NDArray[np.float32]
    # float32 [2]: targets of the two outputs that learn.
    targets: npt.NDArray[np.float32]


@compiled
def compute_outputs(layers: Layers, weights: Any, values: Any) -> None:
    """Compute the hidden units and the outputs of `values` [unit] from its inputs."""
    hidden = layers.hidden
    outputs = layers.outputs
    for hidden_unit in range(hidden):
        total = weights[N_INPUTS * hidden + hidden_unit]
        for i in range(N_INPUTS):
            total += weights[i * hidden + hidden_unit] * values[i]
        values[N_INPUTS + hidden_unit] = sigmoid(total)
    after = (N_INPUTS + 1) * hidden
    for k in range(outputs):
        total = weights[after + hidden * outputs + k]
        for hidden_unit in range(hidden):
            total += weights[after + hidden_unit * outputs + k] * values[N_INPUTS + hidden_unit]
        values[N_INPUTS + hidden + k] = sigmoid(total)


@compiled
def backpropagate(layers: Layers, weights: Any, units: Activations, first: Any) -> None:
    """Do one step of backpropagation from the outputs `first` and `first + 1` to their targets."""
    hidden = layers.hidden
    outputs = layers.outputs
    rate = layers.rate
    values = units.values
    first_output = N_INPUTS + hidden + first
    first_error = _output_error(values[first_output], units.targets[0])
    second_error = _output_error(values[first_output + 1], units.targets[1])
    output_weights = (N_INPUTS + 1) * hidden + first
    for hidden_unit in range(hidden):
        h = values[N_INPUTS + hidden_unit]
        weight = output_weights + hidden_unit * outputs
        error = ZERO
        error += first_error * weights[weight]
        error += second_error * weights[weight + 1]
        weights[weight] -= rate * first_error * h
        weights[weight + 1] -= rate * second_error * h
        error = error * h * (ONE - h)
        for i in range(N_INPUTS):
            weights[i * hidden + hidden_unit] -= rate * error * values[i]
        weights[N_INPUTS * hidden + hidden_unit] -= rate * error
    biases = output_weights + hidden * outputs
    weights[biases] -= rate * first_error
    weights[biases + 1] -= rate * second_error


@compiled
def _output_error(y: Any, target: Any) -> Any:
    return (y - target) * y * (ONE - y)
