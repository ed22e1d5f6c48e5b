"""Agents that can die or be born during a lifetime, or that do not eat all items."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, ClassVar

import numpy as np

from baldwinlab.engine.jit import compiled
from baldwinlab.engine.phases import Array, make_part_type, per_agent
from baldwinlab.engine.simd import (
    ONE,
    ZERO,
    Lane,
    any_of,
    choose,
    first_lane,
    get,
    lanes_of,
    put,
)
from baldwinlab.models.miniworld.birth import CHILD_ARRAYS, CHILD_VALUES, bear_child
from baldwinlab.models.miniworld.map import move_agents
from baldwinlab.models.miniworld.population import FixedPopulation
from baldwinlab.models.miniworld.state import MiniWorldModel, State
from baldwinlab.parts.births_and_deaths import DEAD_X, find_free_slot
from baldwinlab.parts.learning_rules import learn


@compiled
def _learn_living(part: Any, model: MiniWorldModel, state: State, step: int, lane: Lane) -> None:
    """Let the agents that are alive learn, and count the learning steps of each agent."""
    first = first_lane(lane)
    has_dead_agents = any_of(get(state.alive, 0, lane) <= ZERO)
    if has_dead_agents:
        for column in range(first, first + lanes_of(lane)):
            if state.alive[0, column] > ZERO:
                learn(state.rule, model, state, step, column)
    else:
        learn(state.rule, model, state, step, lane)
    for column in range(first, first + lanes_of(lane)):
        part.steps_learned[0, column] += np.int32(state.alive[0, column])


class MortalPopulation(FixedPopulation):
    """One species with agents that can die, or that do not eat all items."""

    # [region]: 1 if the agents eat the items of the region, otherwise 0.
    values: ClassVar[Sequence[str]] = ("eaten_regions",)
    arrays: ClassVar[Mapping[str, Array]] = {
        # Number of steps from birth to death or to the current step.
        "age": per_agent(1, dtype="int32"),
        # Number of steps from birth in which the agent learned.
        "steps_learned": per_agent(1, dtype="int32"),
    }

    @staticmethod
    def start_life(part: Any, state: State, lane: int) -> None:
        state.alive[0, lane] = ONE
        part.age[0, lane] = 0
        part.steps_learned[0, lane] = 0

    @staticmethod
    def is_alive(part: Any, state: State, lane: int) -> bool:
        return bool(state.alive[0, lane] > ZERO)

    @staticmethod
    def eats_region(part: Any, region: int) -> bool:
        return bool(part.eaten_regions[region])

    @staticmethod
    def exclude_dead(part: Any, state: State, lane: Lane) -> None:
        is_living = get(state.alive, 0, lane) > ZERO
        put(state.near, 0, lane, choose(is_living, get(state.near, 0, lane), ZERO))

    @staticmethod
    def move_living(part: Any, model: MiniWorldModel, state: State, lane: Lane) -> None:
        is_living = get(state.alive, 0, lane) > ZERO
        x = get(state.positions, 0, lane)
        y = get(state.positions, 1, lane)
        heading = get(state.heading, 0, lane)
        move_agents(state.features, model, state, lane)
        put(state.positions, 0, lane, choose(is_living, get(state.positions, 0, lane), x))
        put(state.positions, 1, lane, choose(is_living, get(state.positions, 1, lane), y))
        put(state.heading, 0, lane, choose(is_living, get(state.heading, 0, lane), heading))

    @staticmethod
    def learn_living(part: Any, model: MiniWorldModel, state: State, step: int, lane: Lane) -> None:
        _learn_living(part, model, state, step, lane)

    @staticmethod
    def count_step(part: Any, state: State, lane: Lane) -> None:
        first = first_lane(lane)
        for column in range(first, first + lanes_of(lane)):
            part.age[0, column] += np.int32(state.alive[0, column])

    @staticmethod
    def remove_agent(
        part: Any, model: MiniWorldModel, state: State, world: int, agent: int
    ) -> None:
        lane = world * model.agents + agent
        state.alive[0, lane] = ZERO
        state.near[0, lane] = ZERO
        state.alert[0, lane] = 0
        state.positions[0, lane] = DEAD_X * model.width


make_part_type(MortalPopulation, [*MortalPopulation.values, *MortalPopulation.arrays])


class ReproducingPopulation(MortalPopulation):
    """One species with agents that can be born during the lifetimes of other agents.

    The steps in which an agent learns are counted from the birth of the agent.
    """

    values: ClassVar[Sequence[str]] = (*MortalPopulation.values, *CHILD_VALUES)
    arrays: ClassVar[Mapping[str, Array]] = {**MortalPopulation.arrays, **CHILD_ARRAYS}

    @staticmethod
    def has_learners(part: Any, model: MiniWorldModel, step: int) -> bool:
        return True

    @staticmethod
    def learn_living(part: Any, model: MiniWorldModel, state: State, step: int, lane: Lane) -> None:
        # No agent is older than the lifetime. So all agents are young in the first steps.
        if step < model.learning_steps:
            _learn_living(part, model, state, step, lane)
        else:
            first = first_lane(lane)
            for column in range(first, first + lanes_of(lane)):
                # `count_step` has already counted this step.
                is_young = part.age[0, column] <= model.learning_steps
                if state.alive[0, column] > ZERO and is_young:
                    learn(state.rule, model, state, step, column)
                    part.steps_learned[0, column] += 1

    @staticmethod
    def bear_agent(
        part: Any, model: MiniWorldModel, state: State, world: int, parents: tuple[int, int]
    ) -> int:
        slot = find_free_slot(model, state, world)
        if slot >= 0:
            birth = 0
            for agent in range(model.agents):
                birth += state.birth_count[world, agent]
            bear_child(part, model, state, world, slot, birth, parents[0], parents[1])
        return slot


make_part_type(
    ReproducingPopulation, [*ReproducingPopulation.values, *ReproducingPopulation.arrays]
)
