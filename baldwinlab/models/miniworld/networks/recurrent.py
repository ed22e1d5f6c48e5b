"""Networks with a memory: recurrent hidden units, in discrete or continuous time.

The memory is stored in the rows of units between the inputs and the hidden units.
Each module therefore has a separate memory. The memory is 0 at birth, which is our interpretation:
Elman starts with 0.5.

Sources:

- `simple-recurrent`: J. L. Elman, "Finding Structure in Time", Cognitive Science 14 (1990).
- `continuous-time`: R. D. Beer, "On the dynamics of small continuous-time recurrent neural
  networks", Adaptive Behavior 3 (1995). Here, outputs are separate logistic units, and all time
  constants are equal.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, ClassVar

from baldwinlab.engine.arithmetic import sigmoid
from baldwinlab.engine.jit import compiled
from baldwinlab.engine.simd import ONE, Lane
from baldwinlab.models.miniworld.networks.feed_forward import FeedForward, Rows, feed_forward
from baldwinlab.parts import Field, Network, Training, get, put


class _Recurrent(Network):
    """Base of networks in which the units after the inputs store the first hidden layer."""

    is_memoryless: ClassVar[bool] = False

    def memory(
        self, inputs: int, hidden: tuple[int, ...], actions: int
    ) -> tuple[tuple[int, int], ...]:
        return tuple((inputs + hidden[0] + unit, inputs + unit) for unit in range(hidden[0]))


class SimpleRecurrent(_Recurrent, name="simple-recurrent"):
    """Layers of logistic units. Inputs include the last activations of the first hidden layer.

    Learning treats the previous activations as constant inputs.

    References
    ----------
    Elman 1990.
    """

    derived: ClassVar[Mapping[str, Any]] = {
        **FeedForward.derived,
        "inputs": lambda part, experiment: len(experiment.inputs),
        "context": lambda part, experiment: experiment.network.hidden[0],
    }
    backward: ClassVar[Any] = staticmethod(FeedForward.backward)

    def layers(self, inputs: int, hidden: tuple[int, ...], actions: int) -> tuple[int, ...]:
        return (inputs + sum(hidden[:1]), *hidden, actions)

    def check(self, experiment: Any) -> None:
        if not experiment.network.hidden:
            raise ValueError(
                "network.kind = 'simple-recurrent' needs hidden units: "
                "network.hidden must have at least one layer"
            )

    @staticmethod
    def forward(part: Any, weights: Rows, activations: Rows, lane: Lane) -> None:
        for unit in range(part.context):
            put(
                activations,
                part.inputs + unit,
                lane,
                get(activations, part.inputs + part.context + unit, lane),
            )
        feed_forward(part.sizes, part.biases, weights, activations, lane)


class ContinuousTime(_Recurrent, name="continuous-time"):
    """Leaky hidden units, all connected to each other. A time step is one step of Euler's method.

    Learning changes only the weights to the outputs.

    References
    ----------
    Beer 1995.
    """

    time_constant: float = Field(
        4.0,
        ge=1,
        le=1_000_000,
        description=("Time constant of the hidden units, in steps. 1: no memory of the state."),
    )

    derived: ClassVar[Mapping[str, Any]] = {
        "inputs": lambda part, experiment: len(experiment.inputs),
        "hidden": lambda part, experiment: experiment.network.hidden[0],
        "actions": lambda part, experiment: len(experiment.actions),
        "biases": FeedForward.derived["biases"],
    }

    def layers(self, inputs: int, hidden: tuple[int, ...], actions: int) -> tuple[int, ...]:
        """Return the numbers of inputs and states, of hidden activations, and of outputs."""
        return (inputs + sum(hidden), sum(hidden), actions)

    def check(self, experiment: Any) -> None:
        if len(experiment.network.hidden) != 1:
            raise ValueError(
                "network.kind = 'continuous-time' has one hidden layer: "
                "network.hidden must have one entry"
            )

    @staticmethod
    def forward(part: Any, weights: Rows, activations: Rows, lane: Lane) -> None:
        sources = part.inputs + part.hidden
        # A new state is a weighted mean of the old state and the drive.
        drive_share = ONE / part.time_constant
        state_share = ONE - drive_share
        # Birth changes states, and learning changes biases, without an update of the activations.
        _update_hidden(part, weights, activations, lane)
        for unit in range(part.hidden):
            drive = get(weights, unit, lane) * get(activations, 0, lane)
            for i in range(1, part.inputs):
                drive = drive + get(weights, i * part.hidden + unit, lane) * get(
                    activations, i, lane
                )
            # Row i is the state of a hidden unit. Row i + `hidden` is the activation of this unit.
            for i in range(part.inputs, sources):
                drive = drive + get(weights, i * part.hidden + unit, lane) * get(
                    activations, i + part.hidden, lane
                )
            state = part.inputs + unit
            old_state = get(activations, state, lane)
            put(activations, state, lane, state_share * old_state + drive_share * drive)
        _update_hidden(part, weights, activations, lane)
        first_weight = (sources + int(part.biases)) * part.hidden
        first_output = sources + part.hidden
        for unit in range(part.actions):
            total = get(weights, first_weight + unit, lane) * get(activations, sources, lane)
            for i in range(1, part.hidden):
                total = total + get(weights, first_weight + i * part.actions + unit, lane) * get(
                    activations, sources + i, lane
                )
            if part.biases:
                total = total + get(weights, first_weight + part.hidden * part.actions + unit, lane)
            put(activations, first_output + unit, lane, sigmoid(total))

    @staticmethod
    def backward(part: Any, training: Training, lane: Lane) -> None:
        """Apply the delta rule to the weights of the outputs. No other weights learn."""
        weights = training.weights
        sources = part.inputs + part.hidden
        first_weight = (sources + int(part.biases)) * part.hidden
        first_output = sources + part.hidden
        for unit in range(part.actions):
            y = get(training.activations, first_output + unit, lane)
            error = training.rate * (y - get(training.targets, unit, lane)) * y * (ONE - y)
            for i in range(part.hidden):
                weight = first_weight + i * part.actions + unit
                put(
                    weights,
                    weight,
                    lane,
                    get(weights, weight, lane)
                    - error * get(training.activations, sources + i, lane),
                )
            if part.biases:
                bias = first_weight + part.hidden * part.actions + unit
                put(weights, bias, lane, get(weights, bias, lane) - error)


@compiled
def _update_hidden(part: Any, weights: Rows, activations: Rows, lane: Lane) -> None:
    """Set the activations of the hidden units from the states and the biases of the units."""
    first_bias = (part.inputs + part.hidden) * part.hidden
    for unit in range(part.hidden):
        state = get(activations, part.inputs + unit, lane)
        if part.biases:
            state = state + get(weights, first_bias + unit, lane)
        put(activations, part.inputs + part.hidden + unit, lane, sigmoid(state))
