"""Learning rules `none`, `self-taught`, and `drift`, which is the control of self-teaching.

Source: Le (2019), "The Self-learned neural architecture".
`docs/explanation/controls.md` explains the control.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, ClassVar, Final

import numpy as np

from baldwinlab.engine.arithmetic import power_of_ten
from baldwinlab.engine.jit import compiled
from baldwinlab.engine.phases import Array, per_agent
from baldwinlab.engine.rng import DRIFT, philox
from baldwinlab.engine.simd import Lane, get, put
from baldwinlab.models.miniworld.population import agent_number
from baldwinlab.models.miniworld.state import MiniWorldModel, State
from baldwinlab.parts.learning_rules import LearningRule
from baldwinlab.parts.networks import backward, forward

ZERO = np.float32(0)
ONE = np.float32(1)
# Maximum learning rate of an agent whose gene changes the rate.
MAX_RATE: Final = 10.0


@compiled
def express_rate(rate: float, gene: Any) -> np.float32:
    """Return the learning rate of an agent: `rate` times ten to the power of its gene."""
    return np.float32(min(rate * power_of_ten(gene), MAX_RATE))


class NoLearning(LearningRule, name="none"):
    """No learning: the weights do not change during life."""

    learns: ClassVar[bool] = False


class SelfTaught(LearningRule, name="self-taught"):
    """Backpropagation toward the outputs of the inherited reinforcement module.

    References
    ----------
    Le 2019.
    """

    modules: ClassVar[tuple[str, ...]] = ("action", "reinforcement")
    supports_drift_control: ClassVar[bool] = True

    @staticmethod
    def learn(part: Any, model: MiniWorldModel, state: State, step: int, lane: Lane) -> None:
        rate = get(state.rate, 0, lane)
        backward(
            state.network, rate, state.weights, state.activations, state.errors, state.targets, lane
        )

    @staticmethod
    def oracle(part: Any, agents: Any, agent: Any, naive: Any) -> None:
        target = naive.think(agent.reinforcement_module, agent.inputs)
        naive.backpropagate(agent.action_module, agent.inputs, target, agent.rate)


class Drift(LearningRule, name="drift"):
    """Random weight changes of the same size as self-teaching: the drift control.

    A hidden copy of the agent learns by self-teaching from the inputs of the agent.
    Each weight of the agent changes by the same amount as the weight of the copy.
    The direction of the change is random, so the agent learns nothing.
    """

    modules: ClassVar[tuple[str, ...]] = ("action", "reinforcement")
    supports_drift_control: ClassVar[bool] = True
    arrays: ClassVar[Mapping[str, Array]] = {
        # Weights of the copy that learns by self-teaching.
        "shadow_weights": per_agent("weights"),
        "shadow_activations": per_agent("units"),
        "birth_weights": per_agent("weights"),
        # 1 or -1: whether a weight changes as in the copy or in the opposite direction.
        "signs": per_agent("weights"),
    }

    @staticmethod
    def init_agent(part: Any, model: MiniWorldModel, state: State, world: int, agent: int) -> None:
        """Draw for each weight whether it changes as in the copy, or in the opposite direction."""
        lane = world * model.agents + agent
        seed = state.keys[world, 0]
        run = state.keys[world, 1]
        number = agent_number(state.population, agent)
        for weight in range(state.weights.shape[0]):
            words = philox(weight, number, state.generation[0], DRIFT, seed, run)
            is_same_direction = words[0] & np.uint32(1)
            part.signs[weight, lane] = ONE if is_same_direction else -ONE
            part.birth_weights[weight, lane] = state.weights[weight, lane]
            part.shadow_weights[weight, lane] = state.weights[weight, lane]
        for unit in range(state.activations.shape[0]):
            # A network with a memory reads the activations of the previous step.
            part.shadow_activations[unit, lane] = ZERO

    @staticmethod
    def learn(part: Any, model: MiniWorldModel, state: State, step: int, lane: Lane) -> None:
        for k in range(model.inputs):
            put(part.shadow_activations, k, lane, get(state.activations, k, lane))
        forward(state.network, part.shadow_weights, part.shadow_activations, lane)
        rate = get(state.rate, 0, lane)
        backward(
            state.network,
            rate,
            part.shadow_weights,
            part.shadow_activations,
            state.errors,
            state.targets,
            lane,
        )
        for weight in range(state.weights.shape[0]):
            change = get(part.shadow_weights, weight, lane) - get(part.birth_weights, weight, lane)
            put(
                state.weights,
                weight,
                lane,
                get(part.birth_weights, weight, lane) + get(part.signs, weight, lane) * change,
            )

    @staticmethod
    def oracle(part: Any, agents: Any, agent: Any, naive: Any) -> None:
        shadow = naive.module(agent.arrays["shadow_weights"])
        target = naive.think(agent.reinforcement_module, agent.inputs)
        naive.backpropagate(shadow, agent.inputs, target, agent.rate)
        agent.arrays["shadow_weights"] = naive.weights(shadow)
        entries = zip(
            agent.arrays["birth_weights"],
            agent.arrays["signs"],
            agent.arrays["shadow_weights"],
            strict=True,
        )
        agent.action_module = naive.module(
            [weight + sign * (learned_weight - weight) for weight, sign, learned_weight in entries]
        )
