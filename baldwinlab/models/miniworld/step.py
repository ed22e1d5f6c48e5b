"""One lifetime: the phases of a step, in the order of the paper, written once for everybody who takes one.

A lifetime is a pure function of the experiment, the seed and run, the generation and the genomes.

Who takes a step is a type: `AllAgents` of a batch, a bundle of lanes at a time, phase by phase; or
`SingleAgent` agent, as under the sequential update (R7). A venue may add its own (kernels.py): what is done
per world differs between them, and where a venue needs a barrier, it puts it there.
"""

from __future__ import annotations

from typing import Any, NamedTuple

from baldwinlab.engine.jit import compiled
from baldwinlab.engine.phases import for_each_part, hook
from baldwinlab.engine.reference import as_pointer
from baldwinlab.engine.simd import Lane, get, lanes_in_block, simd_block
from baldwinlab.models.miniworld.birth import init_generation
from baldwinlab.models.miniworld.items import eat_items, resort_stale_cells
from baldwinlab.models.miniworld.lookup import compute_outputs
from baldwinlab.models.miniworld.map import ZERO, apply_motor_noise, move_agents
from baldwinlab.models.miniworld.senses.sight import (
    list_sensing_agents,
    mark_agents_near_regions,
    perceive,
)
from baldwinlab.models.miniworld.state import Model, State
from baldwinlab.parts.agent_parts import (
    choose_action,
    end_step,
    learn,
    observe_others,
    prepare_senses,
)

end_step_of_features = for_each_part(end_step)
prepare_all_senses = for_each_part(prepare_senses)


@hook
def lane_of(who: Any, first: int) -> Lane:
    """The lanes that begin with `first`, as many as are worked on at a time."""
    return first


@hook
def prepare_senses_per_world(who: Any, model: Model, state: State, step: int) -> None:
    """Per world: the senses' look at others, before anybody senses."""


@hook
def observe_others_per_world(who: Any, model: Model, state: State, step: int) -> None:
    """Per world: the learning rule's look at others, when all have acted."""


@hook
def eat_all(who: Any, model: Model, state: State, step: int) -> None:
    """All eat. Who touches an item first in the step's order has it."""


@compiled
def take_step(who: Any, model: Model, state: State, step: int) -> None:
    """Sense, think, act, learn, eat."""
    sense_environment(who, model, state, step)
    for first in range(who.first, who.last, who.stride):
        compute_outputs(state.lookup, model, state, lane_of(who, first))
    act_and_learn(who, model, state, step)


@compiled
def sense_environment(who: Any, model: Model, state: State, step: int) -> None:
    """Sense."""
    for first in range(who.first, who.last, who.stride):
        mark_agents_near_regions(model, state, lane_of(who, first))
    prepare_senses_per_world(who, model, state, step)
    for world in range(who.first_world, who.last_world):
        for number in range(
            list_sensing_agents(model, state, world, who.first_agent, who.last_agent)
        ):
            perceive(
                model,
                state,
                world,
                get(state.near_agents, 0, world * model.agents + who.first_agent + number),
            )


@compiled
def act_and_learn(who: Any, model: Model, state: State, step: int) -> None:
    """Act as the outputs say, learn, eat."""
    for first in range(who.first, who.last, who.stride):
        choose_action(state.body, model, state, lane_of(who, first))
    if model.action_noise > ZERO:
        for world in range(who.first_world, who.last_world):
            for agent in range(who.first_agent, who.last_agent):
                apply_motor_noise(model, state, world, world * model.agents + agent, agent, step)
    for first in range(who.first, who.last, who.stride):
        move_agents(state.features, model, state, lane_of(who, first))
    observe_others_per_world(who, model, state, step)
    if step < model.learning_steps:
        for first in range(who.first, who.last, who.stride):
            learn(state.rule, model, state, step, lane_of(who, first))
    eat_all(who, model, state, step)


class _AllAgents:
    """All agents of a batch, at the same time."""

    @staticmethod
    def lane_of(who: Any, first: int) -> Lane:
        return simd_block(first)

    @staticmethod
    def prepare_senses_per_world(who: Any, model: Model, state: State, step: int) -> None:
        for world in range(model.worlds):
            prepare_all_senses(state.senses, model, state, world, step)

    @staticmethod
    def observe_others_per_world(who: Any, model: Model, state: State, step: int) -> None:
        for world in range(model.worlds):
            observe_others(state.rule, model, state, world, step)

    @staticmethod
    def eat_all(who: Any, model: Model, state: State, step: int) -> None:
        for world in range(model.worlds):
            alert = 0
            for agent in range(model.agents):
                alert |= get(state.alert, 0, world * model.agents + agent)
            if alert != 0:  # told many at a time, and most worlds have nobody who is
                agent = step % model.agents
                for _ in range(model.agents):
                    eat_items(model, state, world, agent, step)
                    agent = agent + 1 if agent + 1 < model.agents else 0
            resort_stale_cells(model, state, world)


class _SingleAgent:
    """One agent, when it is its turn."""

    lane_of = staticmethod(lane_of.default)

    @staticmethod
    def prepare_senses_per_world(who: Any, model: Model, state: State, step: int) -> None:
        prepare_all_senses(state.senses, model, state, who.first_world, step)

    @staticmethod
    def observe_others_per_world(who: Any, model: Model, state: State, step: int) -> None:
        observe_others(state.rule, model, state, who.first_world, step)

    @staticmethod
    def eat_all(who: Any, model: Model, state: State, step: int) -> None:
        eat_items(model, state, who.first_world, who.first_agent, step)
        resort_stale_cells(model, state, who.first_world)


class AllAgents(NamedTuple):
    first: int  # lanes, from the first up to, and without, the last
    last: int
    stride: int
    first_world: int
    last_world: int
    first_agent: int
    last_agent: int


class SingleAgent(NamedTuple):
    first: int
    last: int
    stride: int
    first_world: int
    last_world: int
    first_agent: int
    last_agent: int


AllAgents.part, SingleAgent.part = _AllAgents, _SingleAgent  # type: ignore[attr-defined]


@compiled
def all_agents(model: Model, state: State) -> AllAgents:
    return AllAgents(
        0, state.positions.shape[1], lanes_in_block(), 0, model.worlds, 0, model.agents
    )


def simulate_simultaneous(
    model: Model, state: State, newborn: bool, first_step: int, last_step: int
) -> None:
    """Be born, if newborn, and live through the steps from `first_step` up to, and without, `last_step`; all at a time."""
    model, state = as_pointer(model), as_pointer(state)
    if newborn:
        init_generation(model, state)
    everyone = all_agents(model, state)
    for step in range(first_step, last_step):
        take_step(everyone, model, state, step)
        for world in range(model.worlds):
            end_step_of_features(state.features, model, state, world, step)


def simulate_sequential(
    model: Model, state: State, newborn: bool, first_step: int, last_step: int
) -> None:
    """As `simulate_simultaneous`, but agent after agent (R7)."""
    model, state = as_pointer(model), as_pointer(state)
    if newborn:
        init_generation(model, state)
    for step in range(first_step, last_step):
        for world in range(model.worlds):
            agent = step % model.agents
            for _ in range(model.agents):
                lane = world * model.agents + agent
                take_step(
                    SingleAgent(lane, lane + 1, 1, world, world + 1, agent, agent + 1),
                    model,
                    state,
                    step,
                )
                agent = agent + 1 if agent + 1 < model.agents else 0
            end_step_of_features(state.features, model, state, world, step)
