"""Learning to predict: what the hidden units learn for it may serve, or harm, the actions that hear the same units.

The genome holds a second module, "prediction": logistic units, one for each input, that hear the last hidden layer. In every
step the network is asked again what it would have predicted from what it sensed a step ago; the difference to what it senses
now is the error, and a step of backpropagation goes down its gradient through the weights from hidden units to predictions and
those between inputs and hidden units. Weights from hidden units to actions are never taught: they are inherited alone.

The prediction is a module of its own and not further outputs of the action module, so that genomes, founders and the very bits
of who does not learn are those of `none`, and the learner can be switched off in the same genome. Readings of ours: a module
has as many weights as the action module, of which the first are used, [hidden unit (and bias), prediction]; predictions do not
hear the action, which follows from what the hidden units hear (there, the action about to be done is an input; the sense
`last-action` tells what was done a step ago). There is no prediction before the second step of a life.

`random-prediction` is the control: as much teaching of the same weights, towards coin flips in place of what is sensed.

Source: S. Nolfi, J. L. Elman and D. Parisi, "Learning and evolution in neural networks", Adaptive Behavior 3 (1994); random
targets as in D. Parisi, S. Nolfi and F. Cecconi, "Learning, behavior, and evolution" (1992).
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
from baldwinlab.models.miniworld.state import Model, State
from baldwinlab.parts.agent_parts import LearningRule, forward

ZERO, ONE = np.float32(0), np.float32(1)
COINS: Final = 24  # in a random number, as a float32 has it


def _last_hidden(experiment: Any) -> int:
    return int(experiment.layer_sizes[-2])


@compiled
def _learn_prediction(part: Any, model: Model, state: State, told: Any, lane: Lane) -> None:
    """Teach the predictions what they should have been, `told`; write into `part.wanted` where the last hidden layer should be.

    That is where it is, less the gradient of the error by it.
    """
    rate, first = get(state.rate, 0, lane), part.first_hidden
    for k in range(model.inputs):
        total = get(part.predictor, k, lane) * get(part.units, first, lane)
        for unit in range(1, part.hidden):
            total = total + get(part.predictor, unit * model.inputs + k, lane) * get(
                part.units, first + unit, lane
            )
        if part.biases:
            total = total + get(part.predictor, part.hidden * model.inputs + k, lane)
        y = sigmoid(total)
        put(part.errors, k, lane, (y - get(told, k, lane)) * y * (ONE - y))
    for unit in range(part.hidden):
        h = get(part.units, first + unit, lane)
        error = h * ZERO
        for k in range(model.inputs):
            old = get(part.predictor, unit * model.inputs + k, lane)
            error = error + get(part.errors, k, lane) * old
            put(
                part.predictor,
                unit * model.inputs + k,
                lane,
                old - rate * get(part.errors, k, lane) * h,
            )
        put(part.wanted, unit, lane, h - error)
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
def _learn(part: Any, model: Model, state: State, told: Any, step: int, lane: Lane) -> None:
    if step > 0:
        for k in range(model.inputs):
            put(part.units, k, lane, get(part.sensed, k, lane))
        forward(state.network, state.weights, part.units, lane)
        _learn_prediction(part, model, state, told, lane)
        rate = get(state.rate, 0, lane)
        backpropagate(
            part.sizes,
            part.biases,
            rate,
            state.weights,
            part.units,
            state.errors,
            part.wanted,
            lane,
        )
    for k in range(model.inputs):
        put(part.sensed, k, lane, get(state.activations, k, lane))


def _oracle_update(part: Any, agent: Any, naive: Any, target: Sequence[float]) -> None:
    """The oracle of both: predictions are the outputs of a network with the hidden layers of the action module."""
    if agent.step > 0:
        inputs, weights = len(agent.inputs), agent.own["predictor"]
        used = (part.hidden + naive.biases) * inputs
        layer = [weights[row : row + inputs] for row in range(0, used, inputs)]
        naive.backpropagate(
            [*agent.action_module[:-1], layer], agent.own["sensed"], target, agent.rate
        )
        agent.own["predictor"] = [weight for row in layer for weight in row] + weights[used:]
    agent.own["sensed"] = agent.inputs


class _PredictionRule(LearningRule):
    """What both share."""

    modules: ClassVar[tuple[str, ...]] = ("action", "prediction")
    arrays: ClassVar[Mapping[str, Array]] = {
        "predictor": per_agent(
            "weights"
        ),  # from the last hidden layer to the predictions, and unused ones behind
        "sensed": per_agent("inputs"),  # a step ago
        "units": per_agent("units"),
        "errors": per_agent("inputs"),  # of the predictions
        "wanted": per_agent("units"),  # of the last hidden layer
    }
    derived: ClassVar[Mapping[str, Any]] = {
        "sizes": lambda part, experiment: np.array(
            experiment.layer_sizes[:-1], np.int64
        ),  # without the actions
        "biases": lambda part, experiment: experiment.network.biases,
        "hidden": lambda part, experiment: _last_hidden(experiment),
        "first_hidden": lambda part, experiment: sum(experiment.layer_sizes[:-2]),
    }

    def check(self, experiment: Any) -> None:
        rule = f"learning.rule = {self.name!r}"
        if not experiment.part("network.kind").is_memoryless:
            raise ValueError(
                f"{rule} asks the network again what it would have predicted: it must have no memory"
            )
        if not experiment.network.hidden:
            raise ValueError(
                f"{rule} teaches hidden units: network.hidden must have at least one layer"
            )
        needed = (_last_hidden(experiment) + experiment.network.biases) * len(experiment.inputs)
        if needed > experiment.weight_count:
            raise ValueError(
                f"{rule} needs {needed} weights from the last hidden layer to its predictions, and a module has "
                f"{experiment.weight_count}: there must be fewer units in that layer, or more before it"
            )

    @staticmethod
    def load_genes(part: Any, model: Model, state: State, genes: Any, lane: Lane) -> None:
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
    def learn(part: Any, model: Model, state: State, step: int, lane: Lane) -> None:
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
        if len(experiment.inputs) > COINS:
            raise ValueError(
                f"learning.rule = {self.name!r} tosses {COINS} coins, and there are {len(experiment.inputs)} inputs"
            )

    @staticmethod
    def observe_others(part: Any, model: Model, state: State, world: int, step: int) -> None:
        """Toss: the bits of a random word, the highest first; the same whenever they are asked for."""
        for agent in range(model.agents):
            words = philox(
                step, agent, state.generation[0], LIFE, state.keys[world, 0], state.keys[world, 1]
            )
            for k in range(model.inputs):
                part.coins[k, world * model.agents + agent] = np.float32(
                    (words[0] >> np.uint32(31 - k)) & np.uint32(1)
                )

    @staticmethod
    def learn(part: Any, model: Model, state: State, step: int, lane: Lane) -> None:
        _learn(part, model, state, part.coins, step, lane)

    @staticmethod
    def oracle(part: Any, agents: Any, agent: Any, naive: Any) -> None:
        number = naive.drawn(agent, LIFE)[0]
        _oracle_update(
            part,
            agent,
            naive,
            [float(int(number * 2 ** (k + 1)) % 2) for k in range(len(agent.inputs))],
        )
