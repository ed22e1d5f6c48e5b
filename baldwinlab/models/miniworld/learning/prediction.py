"""Learning rules that predict the inputs of the next step.

Predictions and actions have the same hidden units, so learning can improve or impair the actions.

The genome has a second module, "prediction": weights from the last hidden layer to one logistic
unit per input. In each step, the network predicts the current inputs from the inputs of the
previous step. Then backpropagation reduces the error: it changes the weights from inputs to hidden
units, and from hidden units to predictions, but not from hidden units to actions.

Predictions are a separate module, and not further outputs of the action module, so that a
population that does not learn has the same genomes and results as with the rule `none`.

Our interpretation of the paper:

- All modules of a genome have the same number of weights. The prediction module uses only the first
  weights: one for each pair [hidden unit, prediction], then a bias for each prediction.
- Unlike in the paper, the planned action is not an input of the prediction. The sense `last-action`
  adds the previous action.
- The first step of an agent has no prediction.

The control `random-prediction` teaches the same weights with random bits as targets.

Source: S. Nolfi, J. L. Elman and D. Parisi, "Learning and evolution in neural networks", Adaptive
Behavior 3 (1994). Random targets: D. Parisi, S. Nolfi and F. Cecconi, "Learning, behavior, and
evolution" (1992).
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, ClassVar, Final

import numpy as np

from baldwinlab.engine.arithmetic import sigmoid
from baldwinlab.engine.jit import compiled
from baldwinlab.engine.phases import Array, per_agent
from baldwinlab.engine.rng import LIFE, philox
from baldwinlab.engine.simd import ONE, ZERO, Lane, Value, get, put
from baldwinlab.models.miniworld.learning.reward import (
    PREVIOUS_STEP_ARRAYS,
    PreviousStepRule,
    rate_with_previous_step,
    store_step,
)
from baldwinlab.models.miniworld.networks.feed_forward import backpropagate
from baldwinlab.models.miniworld.population import agent_number
from baldwinlab.models.miniworld.state import MiniWorldModel, State
from baldwinlab.parts.networks import Training, forward

# Maximum number of random targets of one bit. The tests take these bits from a float32 of 24 bits.
MAX_RANDOM_BITS: Final = 24
# Index of the highest bit of a random word.
HIGHEST_BIT: Final = 31


def _last_hidden_size(experiment: Any) -> int:
    """Return the number of units of the last hidden layer."""
    return int(experiment.layer_sizes[-2])


@compiled
def _learn_prediction(
    part: Any, model: MiniWorldModel, rate: Value, targets: Any, lane: Lane
) -> None:
    """Teach `targets` [input, lane] to the prediction layer, and set `part.hidden_targets`.

    A target of a hidden unit is the activation of the unit minus the gradient of the error.
    """
    first_hidden = part.first_last_hidden_row
    for k in range(model.inputs):
        # The sum starts with the first product: the order of additions determines the last bits.
        total = get(part.prediction_weights, k, lane) * get(part.activations, first_hidden, lane)
        for unit in range(1, part.n_last_hidden):
            row = unit * model.inputs + k
            total = total + get(part.prediction_weights, row, lane) * get(
                part.activations, first_hidden + unit, lane
            )
        if part.biases:
            bias_row = part.n_last_hidden * model.inputs + k
            total = total + get(part.prediction_weights, bias_row, lane)
        y = sigmoid(total)
        put(part.deltas, k, lane, (y - get(targets, k, lane)) * y * (ONE - y))
    for unit in range(part.n_last_hidden):
        h = get(part.activations, first_hidden + unit, lane)
        # A zero of the type of h: a float32, or a SIMD block of float32.
        gradient = h * ZERO
        for k in range(model.inputs):
            row = unit * model.inputs + k
            delta = get(part.deltas, k, lane)
            # The gradient uses the weight before its change.
            old_weight = get(part.prediction_weights, row, lane)
            gradient = gradient + delta * old_weight
            put(part.prediction_weights, row, lane, old_weight - rate * delta * h)
        put(part.hidden_targets, unit, lane, h - gradient)
    if part.biases:
        for k in range(model.inputs):
            bias_row = part.n_last_hidden * model.inputs + k
            old_bias = get(part.prediction_weights, bias_row, lane)
            put(
                part.prediction_weights,
                bias_row,
                lane,
                old_bias - rate * get(part.deltas, k, lane),
            )


@compiled
def _learn(part: Any, model: MiniWorldModel, state: State, targets: Any, lane: Lane) -> None:
    """Learn to predict `targets` from the previous inputs, then store the current inputs."""
    rate = rate_with_previous_step(part, state, lane)
    for k in range(model.inputs):
        put(part.activations, k, lane, get(part.last_inputs, k, lane))
    forward(state.network, state.weights, part.activations, lane)
    _learn_prediction(part, model, rate, targets, lane)
    training = Training(rate, state.weights, part.activations, state.errors, part.hidden_targets)
    backpropagate(part.sizes, part.biases, training, lane)
    store_step(part, state, lane)


class _PredictionRule(PreviousStepRule):
    """Base of the rules `prediction` and `random-prediction`."""

    modules: ClassVar[tuple[str, ...]] = ("action", "prediction")
    arrays: ClassVar[Mapping[str, Array]] = {
        **PREVIOUS_STEP_ARRAYS,
        # Weights from the last hidden layer to the predictions. The last rows are unused.
        "prediction_weights": per_agent("weights"),
        # Scratch: activations of the action module for the inputs of the previous step.
        "activations": per_agent("units"),
        # Gradients of the error with respect to the inputs of the prediction units.
        "deltas": per_agent("inputs"),
        # Targets of the last hidden layer, in the first rows.
        "hidden_targets": per_agent("units"),
    }
    derived: ClassVar[Mapping[str, Any]] = {
        # [layer]: number of units, without the layer of the actions.
        "sizes": lambda part, experiment: np.array(experiment.layer_sizes[:-1], np.int64),
        "biases": lambda part, experiment: experiment.network.biases,
        "n_last_hidden": lambda part, experiment: _last_hidden_size(experiment),
        "first_last_hidden_row": lambda part, experiment: sum(experiment.layer_sizes[:-2]),
    }

    def check(self, experiment: Any) -> None:
        super().check(experiment)
        rule = f"learning.rule = {self.name!r}"
        if not experiment.network.hidden:
            raise ValueError(
                f"{rule} teaches hidden units: network.hidden must have at least one layer"
            )
        n_sources = _last_hidden_size(experiment) + experiment.network.biases
        needed_weights = n_sources * len(experiment.inputs)
        if needed_weights > experiment.weight_count:
            raise ValueError(
                f"{rule} needs {needed_weights} weights from the last hidden layer to its "
                "predictions, "
                f"but a module has only {experiment.weight_count}: use fewer units in that layer, "
                "or more before it"
            )

    @staticmethod
    def load_genes(part: Any, model: MiniWorldModel, state: State, genes: Any, lane: Lane) -> None:
        for weight in range(state.weights.shape[0]):
            put(part.prediction_weights, weight, lane, get(genes, weight, lane))


class Prediction(_PredictionRule, name="prediction"):
    """Backpropagation toward the inputs of the next step, through an inherited prediction layer.

    The weights from the last hidden layer to the actions do not learn.

    References
    ----------
    Nolfi, Elman and Parisi 1994.
    """

    @staticmethod
    def learn(part: Any, model: MiniWorldModel, state: State, step: int, lane: Lane) -> None:
        _learn(part, model, state, state.activations, lane)


class RandomPrediction(_PredictionRule, name="random-prediction"):
    """As `prediction`, with random bits as targets: a control without information.

    References
    ----------
    Parisi, Nolfi and Cecconi 1992.
    """

    arrays: ClassVar[Mapping[str, Array]] = {
        **_PredictionRule.arrays,
        "random_bits": per_agent("inputs"),
    }

    def check(self, experiment: Any) -> None:
        super().check(experiment)
        if len(experiment.inputs) > MAX_RANDOM_BITS:
            raise ValueError(
                f"learning.rule = {self.name!r} draws {MAX_RANDOM_BITS} bits, but there are "
                f"{len(experiment.inputs)} inputs"
            )

    @staticmethod
    def observe_others(
        part: Any, model: MiniWorldModel, state: State, world: int, step: int
    ) -> None:
        """Draw a random bit for each input: the bits of a random word, from the highest bit.

        Only a per-world hook can draw random numbers, because `learn` computes SIMD blocks.
        """
        for agent in range(model.agents):
            number = agent_number(state.population, agent)
            words = philox(
                step, number, state.generation[0], LIFE, state.keys[world, 0], state.keys[world, 1]
            )
            for k in range(model.inputs):
                bit = (words[0] >> np.uint32(HIGHEST_BIT - k)) & np.uint32(1)
                part.random_bits[k, world * model.agents + agent] = np.float32(bit)

    @staticmethod
    def learn(part: Any, model: MiniWorldModel, state: State, step: int, lane: Lane) -> None:
        _learn(part, model, state, part.random_bits, lane)
