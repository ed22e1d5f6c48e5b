"""Learning rules with a teacher, and the rule `none`.

`self-taught` moves the outputs of an agent toward the outputs of its reinforcement module.
`imitation` moves the outputs of an agent toward the outputs of another agent for the same inputs.
`supervised` has a scripted teacher that goes to visible food.
`random-targets` is the control of rules with targets: the weights change without information.
Random targets also make an agent wander, and a wandering agent finds food.

Sources:

- Self-teaching: Le (2019), "The Self-learned neural architecture".
- Imitation of a fitter agent: N. Le, M. O'Neill and A. Brabazon, "The Baldwin effect reconsidered
  through the prism of social learning", CEC 2018. The choice of the teacher is our interpretation,
  as we do not know the settings of the paper.
- Random targets: D. Parisi, S. Nolfi and F. Cecconi, "Learning, behavior, and evolution" (1992),
  and the control of Nolfi, Elman and Parisi (1994).
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, ClassVar, Final, Literal

import numpy as np
from pydantic import Field

from baldwinlab.engine.arithmetic import power_of_ten
from baldwinlab.engine.jit import compiled
from baldwinlab.engine.phases import Array, per_agent
from baldwinlab.engine.rng import LIFE, philox, unit
from baldwinlab.engine.simd import HALF, INFINITY, ONE, ZERO, Lane, choose, get, put
from baldwinlab.models.miniworld.map import shortest_difference
from baldwinlab.models.miniworld.population import agent_number, is_alive
from baldwinlab.models.miniworld.state import MiniWorldModel, State
from baldwinlab.parts.learning_rules import LearningRule
from baldwinlab.parts.networks import Training, backward, forward

# Maximum learning rate, if a gene changes the rate.
MAX_RATE: Final = 10.0
# Number of random words that `philox` returns.
WORDS_PER_DRAW: Final = 4
FORAGER_INPUTS: Final = ("left", "front", "right")
FORAGER_ACTIONS: Final = ("left", "forward", "right")


@compiled
def express_rate(rate: float, gene: Any) -> np.float32:
    """Return the learning rate of an agent: `rate` times ten to the power of `gene`, at most 10."""
    return np.float32(min(rate * power_of_ten(gene), MAX_RATE))


@compiled
def _learn_targets(state: State, targets: Any, lane: Lane) -> None:
    """Learn by backpropagation toward the targets [action, lane] of the outputs."""
    rate = get(state.rate, 0, lane)
    training = Training(rate, state.weights, state.activations, state.errors, targets)
    backward(state.network, training, lane)


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
        _learn_targets(state, state.targets, lane)


@compiled
def _count_eaten(state: State, lane: int) -> int:
    """Return the number of items that an agent has eaten since birth."""
    eaten = 0
    for region in range(state.eaten_in_life.shape[0]):
        eaten += state.eaten_in_life[region, lane] - state.eaten_before[region, lane]
    return eaten


@compiled
def _choose_best_teacher(part: Any, state: State, first_lane: int, end_lane: int) -> None:
    """Set `part.teacher_index` to the lane with the most eaten items. A tie goes to the first."""
    best_lane = first_lane
    most_eaten = -1
    for lane in range(first_lane, end_lane):
        eaten = _count_eaten(state, lane)
        if eaten > most_eaten and is_alive(state.population, state, lane):
            best_lane = lane
            most_eaten = eaten
    for lane in range(first_lane, end_lane):
        part.teacher_index[0, lane] = best_lane if most_eaten >= part.min_items else lane


@compiled
def _choose_nearest_teacher(
    part: Any, model: MiniWorldModel, state: State, first_lane: int, end_lane: int
) -> None:
    """Set `part.teacher_index` to the lane of the nearest other agent. A tie goes to the first.

    The inner loop changes neighboring lanes, so that the compiler can vectorize this loop.
    """
    for lane in range(first_lane, end_lane):
        put(part.teacher_index, 0, lane, lane)
        put(part.squared_distance, 0, lane, INFINITY)
    for candidate in range(first_lane, end_lane):
        x = get(state.positions, 0, candidate)
        y = get(state.positions, 1, candidate)
        is_living = is_alive(state.population, state, candidate)
        for lane in range(first_lane, end_lane):
            dx = shortest_difference(x - get(state.positions, 0, lane), model.width)
            dy = shortest_difference(y - get(state.positions, 1, lane), model.height)
            squared_distance = dx * dx + dy * dy
            smallest = get(part.squared_distance, 0, lane)
            is_nearer = (squared_distance < smallest) & (lane != candidate) & is_living
            put(
                part.teacher_index,
                0,
                lane,
                choose(is_nearer, candidate, get(part.teacher_index, 0, lane)),
            )
            put(part.squared_distance, 0, lane, choose(is_nearer, squared_distance, smallest))
    for lane in range(first_lane, end_lane):
        if _count_eaten(state, part.teacher_index[0, lane]) < part.min_items:
            part.teacher_index[0, lane] = lane


class Imitation(LearningRule, name="imitation"):
    """Backpropagation toward the action of another agent for the same inputs.

    The imitated agent is the agent that has eaten the most items, or the nearest agent (`teacher`).

    References
    ----------
    Le, O'Neill and Brabazon 2018.
    """

    teacher: Literal["best", "nearest"] = Field(
        "best",
        description=(
            "Imitated agent. best: most items eaten in this lifetime; nearest: smallest distance."
        ),
    )
    min_items: int = Field(
        1,
        ge=0,
        le=1_000_000,
        description="Minimum number of items that the imitated agent has eaten.",
    )
    arrays: ClassVar[Mapping[str, Array]] = {
        # Current weights of the teacher.
        "teacher_weights": per_agent("weights"),
        # Scratch: activations of the teacher for the inputs of the agent.
        "teacher_activations": per_agent("units"),
        # Outputs of the teacher.
        "output_targets": per_agent("actions"),
        # Index of the teacher in the world.
        "teacher_index": per_agent(1, dtype="int32"),
        # Scratch: squared distance to the nearest agent.
        "squared_distance": per_agent(1),
    }
    teacher_array: ClassVar[str] = "teacher_index"
    derived: ClassVar[Mapping[str, Any]] = {
        "is_nearest": lambda part, experiment: part.teacher == "nearest"
    }

    def check(self, experiment: Any) -> None:
        if not experiment.part("network.kind").is_memoryless:
            raise ValueError(
                "learning.rule = 'imitation' evaluates the network of another agent: "
                "the network must have no memory"
            )

    @staticmethod
    def observe_others(
        part: Any, model: MiniWorldModel, state: State, world: int, step: int
    ) -> None:
        first_lane = world * model.agents
        end_lane = (world + 1) * model.agents
        if part.is_nearest:
            _choose_nearest_teacher(part, model, state, first_lane, end_lane)
        else:
            _choose_best_teacher(part, state, first_lane, end_lane)
        for lane in range(first_lane, end_lane):
            # An agent without a teacher imitates itself, and so has no error.
            teacher_lane = part.teacher_index[0, lane]
            for weight in range(state.weights.shape[0]):
                put(part.teacher_weights, weight, lane, get(state.weights, weight, teacher_lane))
            part.teacher_index[0, lane] = teacher_lane - first_lane

    @staticmethod
    def learn(part: Any, model: MiniWorldModel, state: State, step: int, lane: Lane) -> None:
        for k in range(model.inputs):
            put(part.teacher_activations, k, lane, get(state.activations, k, lane))
        forward(state.network, part.teacher_weights, part.teacher_activations, lane)
        first_output = state.activations.shape[0] - state.targets.shape[0]
        for k in range(state.targets.shape[0]):
            put(part.output_targets, k, lane, get(part.teacher_activations, first_output + k, lane))
        _learn_targets(state, part.output_targets, lane)


class Supervised(LearningRule, name="supervised"):
    """Backpropagation toward the action of a scripted forager.

    The forager goes to food in front, else on the left, else on the right. Without visible food, it
    goes forward.
    """

    arrays: ClassVar[Mapping[str, Array]] = {"output_targets": per_agent("actions")}

    def check(self, experiment: Any) -> None:
        has_forager_inputs = experiment.inputs[: len(FORAGER_INPUTS)] == FORAGER_INPUTS
        if not has_forager_inputs or experiment.actions != FORAGER_ACTIONS:
            raise ValueError(
                "learning.rule = 'supervised' is for the first sense 'food' and the body 'walker'"
            )

    @staticmethod
    def learn(part: Any, model: MiniWorldModel, state: State, step: int, lane: Lane) -> None:
        left = get(state.activations, 0, lane)
        front = get(state.activations, 1, lane)
        right = get(state.activations, 2, lane)
        # Food in front has precedence over the left side, and the left side over the right side.
        left = choose(front > HALF, ZERO, left)
        right = choose((front > HALF) | (left > HALF), ZERO, right)
        put(part.output_targets, 0, lane, left)
        put(part.output_targets, 1, lane, ONE - left - right)
        put(part.output_targets, 2, lane, right)
        _learn_targets(state, part.output_targets, lane)


class RandomTargets(LearningRule, name="random-targets"):
    """Backpropagation toward random numbers: a control without information.

    References
    ----------
    Nolfi, Elman and Parisi 1994.
    """

    arrays: ClassVar[Mapping[str, Array]] = {"output_targets": per_agent("actions")}

    def check(self, experiment: Any) -> None:
        if len(experiment.actions) > WORDS_PER_DRAW:
            raise ValueError(
                f"learning.rule = 'random-targets' draws {WORDS_PER_DRAW} targets, but there are "
                f"{len(experiment.actions)} actions"
            )

    @staticmethod
    def observe_others(
        part: Any, model: MiniWorldModel, state: State, world: int, step: int
    ) -> None:
        """Draw a random target for each action."""
        for agent in range(model.agents):
            number = agent_number(state.population, agent)
            words = philox(
                step, number, state.generation[0], LIFE, state.keys[world, 0], state.keys[world, 1]
            )
            lane = world * model.agents + agent
            for k in range(state.targets.shape[0]):
                part.output_targets[k, lane] = unit(words[k])

    @staticmethod
    def learn(part: Any, model: MiniWorldModel, state: State, step: int, lane: Lane) -> None:
        _learn_targets(state, part.output_targets, lane)
