"""Learning rules `none` and `self-taught`.

Source: Le (2019), "The Self-learned neural architecture".
"""

from __future__ import annotations

from typing import Any, ClassVar, Final

import numpy as np

from baldwinlab.engine.arithmetic import power_of_ten
from baldwinlab.engine.jit import compiled
from baldwinlab.engine.simd import Lane, get
from baldwinlab.models.miniworld.state import MiniWorldModel, State
from baldwinlab.parts.learning_rules import LearningRule
from baldwinlab.parts.networks import Training, backward

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
        training = Training(rate, state.weights, state.activations, state.errors, state.targets)
        backward(state.network, training, lane)
