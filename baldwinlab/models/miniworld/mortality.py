"""Agents that can die and be born during a lifetime, or that do not eat all items."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, ClassVar

import numpy as np

from baldwinlab.engine.jit import compiled
from baldwinlab.engine.phases import Array, per_agent, per_world
from baldwinlab.engine.rng import INHERITANCE, MUTATION_GATE, draw_uniforms, philox, uniform
from baldwinlab.engine.simd import (
    Lane,
    any_of,
    choose,
    first_lane,
    get,
    lanes_of,
    put,
)
from baldwinlab.models.miniworld.birth import replace_agent
from baldwinlab.models.miniworld.map import move_agents
from baldwinlab.models.miniworld.population import (
    FixedPopulation,
    make_tuple_type,
    newborn_number,
)
from baldwinlab.models.miniworld.state import MiniWorldModel, State
from baldwinlab.parts.births_and_deaths import DEAD_X, find_free_slot
from baldwinlab.parts.breeding import copy_genome
from baldwinlab.parts.learning_rules import learn
from baldwinlab.parts.variation import vary

ZERO = np.float32(0)
ONE = np.float32(1)


@compiled
def create_child(
    variation: Any,
    state: State,
    world: int,
    number: int,
    fitter_parent: int,
    second_parent: int,
    draws: Any,
    child: Any,
) -> None:
    """Set the genome `child` from two parents. `number` selects the random numbers.

    `draws` is scratch for random numbers.
    """
    seed = state.keys[world, 0]
    run = state.keys[world, 1]
    generation = state.generation[0]
    draw_uniforms(seed, run, generation, INHERITANCE, number, draws)
    gate = uniform(philox(0, number, generation, MUTATION_GATE, seed, run)[0])
    vary(
        variation,
        state.genome[world, fitter_parent],
        state.genome[world, second_parent],
        draws,
        gate,
        child,
    )


class MortalPopulation(FixedPopulation):
    """One species, whose agents can die or do not eat all items."""

    # Whether the agents eat the items of a region, and the variation of the experiment.
    values: ClassVar[Sequence[str]] = ("eaten_regions", "variation")
    arrays: ClassVar[Mapping[str, Array]] = {
        # Number of steps from birth to death or to the current step.
        "age": per_agent(1, dtype="int32"),
        # Number of steps from birth in which the agent learned.
        "steps_learned": per_agent(1, dtype="int32"),
        # Scratch: genome of a child.
        "child": per_world("modules", "genome length"),
        # Scratch: uniform random numbers of variation.
        "draws": per_world("draws", 4, dtype="float64"),
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

    @staticmethod
    def bear_agent(
        part: Any,
        model: MiniWorldModel,
        state: State,
        world: int,
        first_parent: int,
        second_parent: int,
    ) -> int:
        slot = find_free_slot(model, state, world)
        if slot >= 0:
            birth = 0
            for agent in range(model.agents):
                birth += state.birth_count[world, agent]
            number = newborn_number(part, model, birth)
            child = part.child[world]
            draws = part.draws[world]
            create_child(
                part.variation, state, world, number, first_parent, second_parent, draws, child
            )
            first_ancestor = state.origin[world, first_parent, 0]
            second_ancestor = state.origin[world, second_parent, 0]
            copy_genome(child, state.genome[world, slot])
            state.origin[world, slot, 0] = first_ancestor
            state.origin[world, slot, 1] = second_ancestor
            replace_agent(model, state, world, slot, birth)
        return slot


MortalPopulation.Compiled = make_tuple_type(MortalPopulation)
