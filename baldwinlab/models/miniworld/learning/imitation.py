"""Learning rules with a teacher: the best agent, the nearest agent, a script, or random numbers.

`imitation` moves the outputs of an agent toward those of another network for the same inputs.
`supervised` has a scripted teacher that goes to visible food.
`random-targets` is the control of rules with targets. The weights change without information.
Random targets also make an agent wander, and a wandering agent finds food.

Sources:

- Imitation of a fitter agent: N. Le, M. O'Neill and A. Brabazon, "The Baldwin effect reconsidered
  through the prism of social learning", CEC 2018. The choice of the teacher is our interpretation,
  as we do not know the settings of the paper.
- Random targets: D. Parisi, S. Nolfi and F. Cecconi, "Learning, behavior, and evolution" (1992),
  and the control of Nolfi, Elman and Parisi (1994).
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, ClassVar, Literal

import numpy as np
from pydantic import Field

from baldwinlab.engine.jit import compiled
from baldwinlab.engine.phases import Array, per_agent
from baldwinlab.engine.rng import LIFE, philox, unit
from baldwinlab.engine.simd import Lane, choose, get, put
from baldwinlab.models.miniworld.map import shortest_difference
from baldwinlab.models.miniworld.state import MiniWorldModel, State
from baldwinlab.parts.learning_rules import LearningRule
from baldwinlab.parts.networks import backward, forward

ZERO = np.float32(0)
HALF = np.float32(0.5)
ONE = np.float32(1)
INFINITY = np.float32(np.inf)
# Inputs and actions of the scripted forager.
FORAGER_INPUTS_AND_ACTIONS = (
    ("left", "front", "right"),
    ("left", "forward", "right"),
)


@compiled
def _count_eaten(state: State, lane: int) -> int:
    """Return the number of items that an agent has eaten since its birth."""
    eaten = 0
    for region in range(state.eaten_in_life.shape[0]):
        eaten += state.eaten_in_life[region, lane] - state.eaten_before[region, lane]
    return eaten


@compiled
def _choose_best_teacher(part: Any, state: State, first: int, end: int) -> None:
    """Set the teacher to the agent with the most eaten items. A tie goes to the first."""
    best = first
    most_eaten = -1
    for lane in range(first, end):
        eaten = _count_eaten(state, lane)
        if eaten > most_eaten:
            best = lane
            most_eaten = eaten
    for lane in range(first, end):
        part.teacher_index[0, lane] = best if most_eaten >= part.min_items else lane


@compiled
def _choose_nearest_teacher(
    part: Any, model: MiniWorldModel, state: State, first: int, end: int
) -> None:
    """Set the teacher to the nearest other agent. A tie goes to the first.

    The inner loop runs over agents, so that the compiler can vectorize it.
    """
    for lane in range(first, end):
        put(part.teacher_index, 0, lane, lane)
        put(part.distance, 0, lane, INFINITY)
    for candidate in range(first, end):
        x = get(state.positions, 0, candidate)
        y = get(state.positions, 1, candidate)
        for lane in range(first, end):
            dx = shortest_difference(x - get(state.positions, 0, lane), model.width)
            dy = shortest_difference(y - get(state.positions, 1, lane), model.height)
            distance = dx * dx + dy * dy
            smallest_distance = get(part.distance, 0, lane)
            is_nearer = (distance < smallest_distance) & (lane != candidate)
            put(
                part.teacher_index,
                0,
                lane,
                choose(is_nearer, candidate, get(part.teacher_index, 0, lane)),
            )
            put(part.distance, 0, lane, choose(is_nearer, distance, smallest_distance))
    for lane in range(first, end):
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
        "teacher": per_agent("weights"),
        # Scratch: activations of the teacher for the inputs of the agent.
        "units": per_agent("units"),
        # Outputs of the teacher.
        "desired": per_agent("actions"),
        # Number of the teacher in its world.
        "teacher_index": per_agent(1, dtype="int32"),
        # Squared distance to the nearest agent.
        "distance": per_agent(1),
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
        first = world * model.agents
        end = (world + 1) * model.agents
        if part.is_nearest:
            _choose_nearest_teacher(part, model, state, first, end)
        else:
            _choose_best_teacher(part, state, first, end)
        for lane in range(first, end):
            # An agent without a teacher is its own teacher, and does not learn.
            teacher = part.teacher_index[0, lane]
            for weight in range(state.weights.shape[0]):
                put(part.teacher, weight, lane, get(state.weights, weight, teacher))
            part.teacher_index[0, lane] = teacher - first

    @staticmethod
    def learn(part: Any, model: MiniWorldModel, state: State, step: int, lane: Lane) -> None:
        for k in range(model.inputs):
            put(part.units, k, lane, get(state.activations, k, lane))
        forward(state.network, part.teacher, part.units, lane)
        first_output = state.activations.shape[0] - state.targets.shape[0]
        for k in range(state.targets.shape[0]):
            put(part.desired, k, lane, get(part.units, first_output + k, lane))
        rate = get(state.rate, 0, lane)
        backward(
            state.network, rate, state.weights, state.activations, state.errors, part.desired, lane
        )

    @staticmethod
    def oracle(part: Any, agents: Any, agent: Any, naive: Any) -> None:
        teacher = max(agents, key=lambda neighbor: neighbor.eaten_in_life)
        if part.is_nearest:
            teacher = min(
                (neighbor for neighbor in agents if neighbor is not agent),
                key=lambda neighbor: naive.distance(agent, neighbor),
            )
        if teacher.eaten_in_life >= part.min_items and teacher is not agent:
            target = naive.think(teacher.action_module, agent.inputs)
            naive.backpropagate(agent.action_module, agent.inputs, target, agent.rate)


class Supervised(LearningRule, name="supervised"):
    """Backpropagation toward the action of a scripted forager.

    The forager goes to food in front, else on the left, else on the right. Without visible food, it
    goes forward.
    """

    arrays: ClassVar[Mapping[str, Array]] = {"desired": per_agent("actions")}

    def check(self, experiment: Any) -> None:
        if (experiment.inputs[:3], experiment.actions) != FORAGER_INPUTS_AND_ACTIONS:
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
        put(part.desired, 0, lane, left)
        put(part.desired, 1, lane, ONE - left - right)
        put(part.desired, 2, lane, right)
        rate = get(state.rate, 0, lane)
        backward(
            state.network, rate, state.weights, state.activations, state.errors, part.desired, lane
        )

    @staticmethod
    def oracle(part: Any, agents: Any, agent: Any, naive: Any) -> None:
        left, front, right = agent.inputs[:3]
        sides = {"forward": front, "left": left, "right": right}
        target = next((side for side, is_visible in sides.items() if is_visible), "forward")
        desired = [float(target == action) for action in FORAGER_INPUTS_AND_ACTIONS[1]]
        naive.backpropagate(agent.action_module, agent.inputs, desired, agent.rate)


class RandomTargets(LearningRule, name="random-targets"):
    """Backpropagation toward random numbers: a control without information.

    References
    ----------
    Nolfi, Elman and Parisi 1994.
    """

    arrays: ClassVar[Mapping[str, Array]] = {"desired": per_agent("actions")}

    def check(self, experiment: Any) -> None:
        if len(experiment.actions) > 4:
            raise ValueError(
                f"learning.rule = 'random-targets' draws 4 targets, but there are "
                f"{len(experiment.actions)} actions"
            )

    @staticmethod
    def observe_others(
        part: Any, model: MiniWorldModel, state: State, world: int, step: int
    ) -> None:
        """Draw a random target for each action."""
        for agent in range(model.agents):
            words = philox(
                step, agent, state.generation[0], LIFE, state.keys[world, 0], state.keys[world, 1]
            )
            lane = world * model.agents + agent
            for k in range(state.targets.shape[0]):
                part.desired[k, lane] = unit(words[k])

    @staticmethod
    def learn(part: Any, model: MiniWorldModel, state: State, step: int, lane: Lane) -> None:
        rate = get(state.rate, 0, lane)
        backward(
            state.network, rate, state.weights, state.activations, state.errors, part.desired, lane
        )

    @staticmethod
    def oracle(part: Any, agents: Any, agent: Any, naive: Any) -> None:
        naive.backpropagate(
            agent.action_module,
            agent.inputs,
            naive.random_numbers(agent, LIFE)[: len(agent.outputs)],
            agent.rate,
        )
