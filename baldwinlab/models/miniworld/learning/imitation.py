"""Learning from others: from the best forager of the world, from whoever is nearest, from a scripted forager, or from chance.

`imitation` moves an agent's answers towards what another's network would answer to the agent's own input, as it stands in that
step. `supervised` has a teacher that goes to food that it sees. `random-targets` is the control of every rule with targets: as
much teaching, and nothing to be learned; but what it teaches is also to wander, and who wanders finds food.

Sources: imitation of a fitter one as in N. Le, M. O'Neill and A. Brabazon, "The Baldwin effect reconsidered through the prism of
social learning", CEC 2018 (its numbers are not known to us, so whom and how are readings of ours); random targets as in
D. Parisi, S. Nolfi and F. Cecconi, "Learning, behavior, and evolution" (1992), and the control of Nolfi, Elman and Parisi (1994).
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
from baldwinlab.models.miniworld.state import Model, State
from baldwinlab.parts.agent_parts import LearningRule, backward, forward

ZERO, HALF, ONE, INFINITY = np.float32(0), np.float32(0.5), np.float32(1), np.float32(np.inf)
FORAGER = (
    ("left", "front", "right"),
    ("left", "forward", "right"),
)  # the senses and actions of the scripted forager


@compiled
def _count_eaten(state: State, lane: int) -> int:
    """Items eaten in this life so far."""
    eaten = 0
    for region in range(state.eaten_in_life.shape[0]):
        eaten += state.eaten_in_life[region, lane] - state.eaten_before[region, lane]
    return eaten


@compiled
def _choose_best_teacher(part: Any, state: State, first: int, end: int) -> None:
    """From whom to learn: who has eaten most in its life so far, of equals the first."""
    best, most = first, -1
    for lane in range(first, end):
        eaten = _count_eaten(state, lane)
        if eaten > most:
            best, most = lane, eaten
    for lane in range(first, end):
        part.teacher_index[0, lane] = best if most >= part.min_items else lane


@compiled
def _choose_nearest_teacher(part: Any, model: Model, state: State, first: int, end: int) -> None:
    """From whom to learn: whoever else is nearest, of equals the first.

    Each in turn is held beside all, and not all beside each: so the processor takes many at a time.
    """
    for lane in range(first, end):
        put(part.teacher_index, 0, lane, lane)
        put(part.distance, 0, lane, INFINITY)
    for other in range(first, end):
        x, y = get(state.positions, 0, other), get(state.positions, 1, other)
        for lane in range(first, end):
            dx = shortest_difference(x - get(state.positions, 0, lane), model.width)
            dy = shortest_difference(y - get(state.positions, 1, lane), model.height)
            distance, least = dx * dx + dy * dy, get(part.distance, 0, lane)
            nearer = (distance < least) & (lane != other)
            put(
                part.teacher_index, 0, lane, choose(nearer, other, get(part.teacher_index, 0, lane))
            )
            put(part.distance, 0, lane, choose(nearer, distance, least))
    for lane in range(first, end):
        if _count_eaten(state, part.teacher_index[0, lane]) < part.min_items:
            part.teacher_index[0, lane] = lane


class Imitation(LearningRule, name="imitation"):
    """Backpropagation toward the action of another agent for the same inputs.

    The imitated agent is the best forager so far, or the nearest agent (`teacher`).

    References
    ----------
    Le, O'Neill and Brabazon 2018.
    """

    teacher: Literal["best", "nearest"] = Field(
        "best",
        description=("Imitated agent. best: most items eaten so far; nearest: smallest distance."),
    )
    min_items: int = Field(
        1,
        ge=0,
        le=1_000_000,
        description="Minimum number of items that the imitated agent has eaten.",
    )
    arrays: ClassVar[Mapping[str, Array]] = {
        "teacher": per_agent("weights"),  # the other's, as they stand
        "units": per_agent("units"),
        "wanted": per_agent("actions"),
        "teacher_index": per_agent(1, dtype="int32"),
        "distance": per_agent(1),  # to the nearest so far
    }
    teacher_array: ClassVar[str] = "teacher_index"
    derived: ClassVar[Mapping[str, Any]] = {
        "of_nearest": lambda part, experiment: part.teacher == "nearest"
    }

    def check(self, experiment: Any) -> None:
        if not experiment.part("network.kind").is_memoryless:
            raise ValueError(
                "learning.rule = 'imitation' asks another's network with one's own inputs: it must have no memory"
            )

    @staticmethod
    def observe_others(part: Any, model: Model, state: State, world: int, step: int) -> None:
        first, end = world * model.agents, (world + 1) * model.agents
        if part.of_nearest:
            _choose_nearest_teacher(part, model, state, first, end)
        else:
            _choose_best_teacher(part, state, first, end)
        for lane in range(first, end):
            teacher = part.teacher_index[0, lane]  # itself, where it is to learn from nobody
            for weight in range(state.weights.shape[0]):
                put(part.teacher, weight, lane, get(state.weights, weight, teacher))
            part.teacher_index[0, lane] = teacher - first

    @staticmethod
    def learn(part: Any, model: Model, state: State, step: int, lane: Lane) -> None:
        for k in range(model.inputs):
            put(part.units, k, lane, get(state.activations, k, lane))
        forward(state.network, part.teacher, part.units, lane)
        first = state.activations.shape[0] - state.targets.shape[0]
        for k in range(state.targets.shape[0]):
            put(part.wanted, k, lane, get(part.units, first + k, lane))
        rate = get(state.rate, 0, lane)
        backward(
            state.network, rate, state.weights, state.activations, state.errors, part.wanted, lane
        )

    @staticmethod
    def oracle(part: Any, agents: Any, agent: Any, naive: Any) -> None:
        other = max(agents, key=lambda each: each.eaten_in_life)
        if part.of_nearest:
            other = min(
                (each for each in agents if each is not agent),
                key=lambda each: naive.distance(agent, each),
            )
        if other.eaten_in_life >= part.min_items and other is not agent:
            target = naive.think(other.action_module, agent.inputs)
            naive.backpropagate(agent.action_module, agent.inputs, target, agent.rate)


class Supervised(LearningRule, name="supervised"):
    """Backpropagation toward the action of a scripted forager.

    The forager prefers food in front, then left, then right, and otherwise goes straight on.
    """

    arrays: ClassVar[Mapping[str, Array]] = {"wanted": per_agent("actions")}

    def check(self, experiment: Any) -> None:
        if (experiment.inputs[:3], experiment.actions) != FORAGER:
            raise ValueError(
                "learning.rule = 'supervised' is for the first sense 'food' and the body 'walker'"
            )

    @staticmethod
    def learn(part: Any, model: Model, state: State, step: int, lane: Lane) -> None:
        left, front, right = (
            get(state.activations, 0, lane),
            get(state.activations, 1, lane),
            get(state.activations, 2, lane),
        )
        left = choose(front > HALF, ZERO, left)
        right = choose((front > HALF) | (left > HALF), ZERO, right)
        put(part.wanted, 0, lane, left)
        put(part.wanted, 1, lane, ONE - left - right)
        put(part.wanted, 2, lane, right)
        rate = get(state.rate, 0, lane)
        backward(
            state.network, rate, state.weights, state.activations, state.errors, part.wanted, lane
        )

    @staticmethod
    def oracle(part: Any, agents: Any, agent: Any, naive: Any) -> None:
        left, front, right = agent.inputs[:3]
        does = "forward" if front else "left" if left else "right" if right else "forward"
        wanted = [float(does == action) for action in FORAGER[1]]
        naive.backpropagate(agent.action_module, agent.inputs, wanted, agent.rate)


class RandomTargets(LearningRule, name="random-targets"):
    """Backpropagation toward random numbers: a control without information.

    References
    ----------
    Nolfi, Elman and Parisi 1994.
    """

    arrays: ClassVar[Mapping[str, Array]] = {"wanted": per_agent("actions")}

    def check(self, experiment: Any) -> None:
        if len(experiment.actions) > 4:
            raise ValueError(
                f"learning.rule = 'random-targets' draws 4 targets, and there are {len(experiment.actions)} actions"
            )

    @staticmethod
    def observe_others(part: Any, model: Model, state: State, world: int, step: int) -> None:
        """Draw: a number for each action, the same whenever it is asked."""
        for agent in range(model.agents):
            words = philox(
                step, agent, state.generation[0], LIFE, state.keys[world, 0], state.keys[world, 1]
            )
            lane = world * model.agents + agent
            for k in range(state.targets.shape[0]):
                part.wanted[k, lane] = unit(words[k])

    @staticmethod
    def learn(part: Any, model: Model, state: State, step: int, lane: Lane) -> None:
        rate = get(state.rate, 0, lane)
        backward(
            state.network, rate, state.weights, state.activations, state.errors, part.wanted, lane
        )

    @staticmethod
    def oracle(part: Any, agents: Any, agent: Any, naive: Any) -> None:
        naive.backpropagate(
            agent.action_module,
            agent.inputs,
            naive.drawn(agent, LIFE)[: len(agent.outputs)],
            agent.rate,
        )
