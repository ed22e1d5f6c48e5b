"""Learning rules that predict the inputs of the next step.

Predictions and actions have the same hidden units, so learning can improve or impair the actions.

The genome has a second module, "prediction": one logistic unit per input, on the last hidden layer.
In each step, the network predicts the current inputs from those of the last step.
One step of backpropagation reduces the error. It changes the weights from inputs to hidden units,
and from hidden units to predictions. It does not change the weights from hidden units to actions.

The prediction is a separate module, and not further outputs of the action module.
Without learning, genomes, founders and results are therefore those of the rule `none`.

Interpretation of the paper: a module has as many weights as the action module. The prediction uses
the first of these weights, as [hidden unit (and bias), prediction].
The prediction does not get the action as an input. In the paper, the next action is an input.
The sense `last-action` adds the previous action.
The first step of a lifetime has no prediction.

`random-prediction` is the control: it teaches the same weights with random bits as targets.

Source: S. Nolfi, J. L. Elman and D. Parisi, "Learning and evolution in neural networks", Adaptive
Behavior 3 (1994). Random targets: D. Parisi, S. Nolfi and F. Cecconi, "Learning, behavior, and
evolution" (1992).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, ClassVar, Final

import numpy as np

from baldwinlab.engine.arithmetic import sigmoid
from baldwinlab.engine.jit import compiled
from baldwinlab.engine.phases import Array, per_agent
from baldwinlab.engine.rng import LIFE, philox
from baldwinlab.engine.simd import Lane, get, put
from baldwinlab.models.miniworld.networks.feed_forward import backpropagate
from baldwinlab.models.miniworld.state import MiniWorldModel, State
from baldwinlab.parts.learning_rules import LearningRule
from baldwinlab.parts.networks import forward

ZERO = np.float32(0)
ONE = np.float32(1)
# Number of random bits in a float32 number of the oracle. A target uses one bit.
MAX_RANDOM_BITS: Final = 24


def _last_hidden_size(experiment: Any) -> int:
    """Return the number of units of the last hidden layer."""
    return int(experiment.layer_sizes[-2])


@compiled
def _learn_prediction(
    part: Any, model: MiniWorldModel, state: State, targets: Any, lane: Lane
) -> None:
    """Teach the prediction layer its `targets`, and set `part.desired` of the last hidden layer.

    The desired activations are the activations minus the gradient of the error.
    """
    rate = get(state.rate, 0, lane)
    first = part.first_hidden
    for k in range(model.inputs):
        total = get(part.predictor, k, lane) * get(part.units, first, lane)
        for unit in range(1, part.hidden):
            total = total + get(part.predictor, unit * model.inputs + k, lane) * get(
                part.units, first + unit, lane
            )
        if part.biases:
            total = total + get(part.predictor, part.hidden * model.inputs + k, lane)
        y = sigmoid(total)
        put(part.errors, k, lane, (y - get(targets, k, lane)) * y * (ONE - y))
    for unit in range(part.hidden):
        h = get(part.units, first + unit, lane)
        # 0 in all lanes of h.
        error = h * ZERO
        for k in range(model.inputs):
            old_weight = get(part.predictor, unit * model.inputs + k, lane)
            error = error + get(part.errors, k, lane) * old_weight
            put(
                part.predictor,
                unit * model.inputs + k,
                lane,
                old_weight - rate * get(part.errors, k, lane) * h,
            )
        put(part.desired, unit, lane, h - error)
    if part.biases:
        for k in range(model.inputs):
            row = part.hidden * model.inputs + k
            put(
                part.predictor,
                row,
                lane,
                get(part.predictor, row, lane) - rate * get(part.errors, k, lane),
            )


@compiled
def _learn(
    part: Any, model: MiniWorldModel, state: State, targets: Any, step: int, lane: Lane
) -> None:
    """Predict `targets` from the inputs of the last step, learn, and store the current inputs."""
    # The first step of a lifetime has no last step.
    if step > 0:
        for k in range(model.inputs):
            put(part.units, k, lane, get(part.sensed, k, lane))
        forward(state.network, state.weights, part.units, lane)
        _learn_prediction(part, model, state, targets, lane)
        rate = get(state.rate, 0, lane)
        backpropagate(
            part.sizes,
            part.biases,
            rate,
            state.weights,
            part.units,
            state.errors,
            part.desired,
            lane,
        )
    for k in range(model.inputs):
        put(part.sensed, k, lane, get(state.activations, k, lane))


def _oracle_update(part: Any, agent: Any, naive: Any, target: Sequence[float]) -> None:
    """Compute the update of both rules in plain Python.

    Predictions are the outputs of a network with the hidden layers of the action module.
    """
    if agent.step > 0:
        inputs = len(agent.inputs)
        weights = agent.arrays["predictor"]
        used_weights = (part.hidden + naive.biases) * inputs
        layer = [weights[start : start + inputs] for start in range(0, used_weights, inputs)]
        naive.backpropagate(
            [*agent.action_module[:-1], layer], agent.arrays["sensed"], target, agent.rate
        )
        agent.arrays["predictor"] = [weight for row in layer for weight in row] + weights[
            used_weights:
        ]
    agent.arrays["sensed"] = agent.inputs


class _PredictionRule(LearningRule):
    """Base of the rules `prediction` and `random-prediction`."""

    modules: ClassVar[tuple[str, ...]] = ("action", "prediction")
    arrays: ClassVar[Mapping[str, Array]] = {
        # Weights from the last hidden layer to the predictions. The last weights are unused.
        "predictor": per_agent("weights"),
        # Inputs of the last step.
        "sensed": per_agent("inputs"),
        # Scratch: activations of the action module for these inputs.
        "units": per_agent("units"),
        # Errors of the predictions.
        "errors": per_agent("inputs"),
        # Desired activations of the last hidden layer.
        "desired": per_agent("units"),
    }
    derived: ClassVar[Mapping[str, Any]] = {
        # Numbers of units of all layers but the actions.
        "sizes": lambda part, experiment: np.array(experiment.layer_sizes[:-1], np.int64),
        "biases": lambda part, experiment: experiment.network.biases,
        "hidden": lambda part, experiment: _last_hidden_size(experiment),
        "first_hidden": lambda part, experiment: sum(experiment.layer_sizes[:-2]),
    }

    def check(self, experiment: Any) -> None:
        rule = f"learning.rule = {self.name!r}"
        if not experiment.part("network.kind").is_memoryless:
            raise ValueError(
                f"{rule} evaluates the network twice for the same inputs: "
                "the network must have no memory"
            )
        if not experiment.network.hidden:
            raise ValueError(
                f"{rule} teaches hidden units: network.hidden must have at least one layer"
            )
        needed_weights = (_last_hidden_size(experiment) + experiment.network.biases) * len(
            experiment.inputs
        )
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
            put(part.predictor, weight, lane, get(genes, weight, lane))


class Prediction(_PredictionRule, name="prediction"):
    """Backpropagation toward the inputs of the next step, through an inherited prediction layer.

    The weights from the last hidden layer to the actions do not learn.

    References
    ----------
    Nolfi, Elman and Parisi 1994.
    """

    @staticmethod
    def learn(part: Any, model: MiniWorldModel, state: State, step: int, lane: Lane) -> None:
        _learn(part, model, state, state.activations, step, lane)

    @staticmethod
    def oracle(part: Any, agents: Any, agent: Any, naive: Any) -> None:
        _oracle_update(part, agent, naive, agent.inputs)


class RandomPrediction(_PredictionRule, name="random-prediction"):
    """As `prediction`, with random bits as targets: a control without information.

    References
    ----------
    Parisi, Nolfi and Cecconi 1992.
    """

    arrays: ClassVar[Mapping[str, Array]] = {**_PredictionRule.arrays, "coins": per_agent("inputs")}

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
        """Draw a random bit for each input: the bits of a random word, from the highest bit."""
        for agent in range(model.agents):
            words = philox(
                step, agent, state.generation[0], LIFE, state.keys[world, 0], state.keys[world, 1]
            )
            for k in range(model.inputs):
                part.coins[k, world * model.agents + agent] = np.float32(
                    (words[0] >> np.uint32(31 - k)) & np.uint32(1)
                )

    @staticmethod
    def learn(part: Any, model: MiniWorldModel, state: State, step: int, lane: Lane) -> None:
        _learn(part, model, state, part.coins, step, lane)

    @staticmethod
    def oracle(part: Any, agents: Any, agent: Any, naive: Any) -> None:
        number = naive.random_numbers(agent, LIFE)[0]
        _oracle_update(
            part,
            agent,
            naive,
            [float(int(number * 2 ** (k + 1)) % 2) for k in range(len(agent.inputs))],
        )
