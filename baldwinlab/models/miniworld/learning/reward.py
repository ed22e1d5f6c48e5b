"""Learning rules that reinforce actions, and the base of rules that learn from the previous step.

`crbp` is complementary reinforcement backpropagation. An inherited network evaluates the inputs.
If the evaluation rises, the last action becomes more likely. If the evaluation falls, the last
action becomes less likely. `reward` uses the energy of eaten items instead.
Both rules teach the last action for the inputs of the last step.

In the first step after birth, an agent has no previous step. The rule then changes no weights, and
only stores the inputs and the action.

Interpretation of the paper: the evaluation is the first output of the reinforcement module.
The action is the largest output, and not a random draw. After a rise, the last action has the
target 1 and the other actions have the target 0. After a fall, these targets are reversed.

Source: D. H. Ackley and M. L. Littman, "Interactions between learning and evolution", Artificial
Life II (1991), 487-509. CRBP: D. H. Ackley and M. L. Littman, "Generalization and scaling in
reinforcement learning", NIPS 2 (1990).
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, ClassVar, Final

import numpy as np
from pydantic import Field

from baldwinlab.engine.jit import compiled
from baldwinlab.engine.phases import Array, per_agent
from baldwinlab.engine.simd import HALF, ONE, ZERO, Lane, Value, choose, get, put
from baldwinlab.models.miniworld.regions import ENERGY_VALUES, energy_in_life
from baldwinlab.models.miniworld.state import MiniWorldModel, State
from baldwinlab.parts.learning_rules import LearningRule
from baldwinlab.parts.networks import Training, backward, forward

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
    """Return the learning rate of an agent, or 0 if the agent has no previous step."""
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


# Arrays of both rules.
REINFORCEMENT_ARRAYS: Final[Mapping[str, Array]] = {
    **PREVIOUS_STEP_ARRAYS,
    # Evaluation, or energy gained in life, in the last step.
    "evaluation": per_agent(1),
    # 1 for the action of the last step, and 0 for the other actions. All 0 at birth.
    "last_action": per_agent("actions"),
    # Scratch: activations for the inputs of the previous step.
    "activations": per_agent("units"),
    # Scratch: targets of the outputs.
    "output_targets": per_agent("actions"),
}


@compiled
def _reinforce(part: Any, state: State, evaluation: Value, lane: Lane) -> None:
    """Teach the last action if `evaluation` has risen, or all other actions if it has fallen.

    Then store the inputs and the action of this step.
    """
    change = evaluation - get(part.evaluation, 0, lane)
    actions = state.targets.shape[0]
    for k in range(part.last_inputs.shape[0]):
        put(part.activations, k, lane, get(part.last_inputs, k, lane))
    forward(state.network, state.weights, part.activations, lane)
    for k in range(actions):
        was_done = get(part.last_action, k, lane)
        put(part.output_targets, k, lane, choose(change > ZERO, was_done, ONE - was_done))
    rate = rate_with_previous_step(part, state, lane)
    rate = choose(change > ZERO, rate, choose(change < ZERO, rate * part.punishment, ZERO))
    training = Training(rate, state.weights, part.activations, state.errors, part.output_targets)
    backward(state.network, training, lane)
    put(part.evaluation, 0, lane, evaluation)
    store_step(part, state, lane)
    for k in range(actions):
        is_action = abs(get(state.action, 0, lane) - np.float32(k)) < HALF
        put(part.last_action, k, lane, choose(is_action, ONE, ZERO))


class _ReinforcementRule(PreviousStepRule):
    """Base of the rules `crbp` and `reward`."""

    arrays: ClassVar[Mapping[str, Array]] = REINFORCEMENT_ARRAYS

    @staticmethod
    def init_agent(part: Any, model: MiniWorldModel, state: State, world: int, agent: int) -> None:
        """Let a newborn have no previous step, and no last action."""
        lane = world * model.agents + agent
        reset_previous_step(part, lane)
        part.evaluation[0, lane] = ZERO
        for k in range(state.targets.shape[0]):
            part.last_action[k, lane] = ZERO


class Complementary(_ReinforcementRule, name="crbp"):
    """Reinforcement by an inherited evaluation network (complementary backpropagation).

    The last action becomes more likely if the evaluation has risen, and less likely if it has
    fallen.

    References
    ----------
    Ackley and Littman 1991.
    """

    modules: ClassVar[tuple[str, ...]] = ("action", "reinforcement")
    answers: ClassVar[tuple[str, ...]] = ("evaluation",)
    punishment: float = Field(
        0.1,
        ge=0,
        le=1,
        description=(
            "Learning rate after a fall of the evaluation, relative to the rate after a rise."
        ),
    )

    @staticmethod
    def learn(part: Any, model: MiniWorldModel, state: State, step: int, lane: Lane) -> None:
        _reinforce(part, state, get(state.targets, 0, lane), lane)


class Reward(_ReinforcementRule, name="reward"):
    """As `crbp`, with the gained energy instead of an evaluation."""

    punishment: float = Field(
        1.0,
        ge=0,
        le=1,
        description="Learning rate after a loss of energy, relative to the rate after a gain.",
    )
    arrays: ClassVar[Mapping[str, Array]] = {
        **REINFORCEMENT_ARRAYS,
        "gained_energy": per_agent(1),
    }
    derived: ClassVar[Mapping[str, Any]] = ENERGY_VALUES

    @staticmethod
    def observe_others(
        part: Any, model: MiniWorldModel, state: State, world: int, step: int
    ) -> None:
        """Set `part.gained_energy` to the energy that each agent has gained since birth.

        Only a per-world hook can read the numbers of eaten items, which are integers.
        """
        for lane in range(world * model.agents, (world + 1) * model.agents):
            part.gained_energy[0, lane] = energy_in_life(part, state, lane)

    @staticmethod
    def learn(part: Any, model: MiniWorldModel, state: State, step: int, lane: Lane) -> None:
        _reinforce(part, state, get(part.gained_energy, 0, lane), lane)
