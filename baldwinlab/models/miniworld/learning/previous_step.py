"""Base of learning rules that learn from the inputs of the previous step.

A newborn has no previous step: neither in the first step of a lifetime, nor if it is born during
the lifetimes of other agents. Its first step stores its inputs, and does not change its weights.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, ClassVar, Final

from baldwinlab.engine.jit import compiled
from baldwinlab.engine.phases import Array, per_agent
from baldwinlab.engine.simd import ONE, ZERO, Lane, Value, get, put
from baldwinlab.models.miniworld.state import MiniWorldModel, State
from baldwinlab.parts.learning_rules import LearningRule

PREVIOUS_STEP_ARRAYS: Final[Mapping[str, Array]] = {
    # 0 from birth until the end of the first step of the agent, then 1.
    "has_previous_step": per_agent(1),
    "last_inputs": per_agent("inputs"),
}


@compiled
def reset_previous_step(part: Any, lane: int) -> None:
    """Let a newborn have no previous step, for the hook `init_agent`."""
    part.has_previous_step[0, lane] = ZERO
    for k in range(part.last_inputs.shape[0]):
        part.last_inputs[k, lane] = ZERO


@compiled
def rate_with_previous_step(part: Any, state: State, lane: Lane) -> Value:
    """Return the learning rate of an agent, and 0 if it has no previous step."""
    return get(state.rate, 0, lane) * get(part.has_previous_step, 0, lane)


@compiled
def store_step(part: Any, state: State, lane: Lane) -> None:
    """Store the inputs of this step for the next one, at the end of the hook `learn`."""
    put(part.has_previous_step, 0, lane, ONE)
    for k in range(part.last_inputs.shape[0]):
        # The first activations of the action module are the inputs of this step.
        put(part.last_inputs, k, lane, get(state.activations, k, lane))


class PreviousStepRule(LearningRule):
    """Base of learning rules that learn from the inputs of the previous step."""

    arrays: ClassVar[Mapping[str, Array]] = PREVIOUS_STEP_ARRAYS

    def check(self, experiment: Any) -> None:
        if not experiment.part("network.kind").is_memoryless:
            raise ValueError(
                f"learning.rule = {self.name!r} evaluates the network twice for "
                "the same inputs: the network must have no memory"
            )

    @staticmethod
    def init_agent(part: Any, model: MiniWorldModel, state: State, world: int, agent: int) -> None:
        """Let a newborn have no previous step."""
        reset_previous_step(part, world * model.agents + agent)
